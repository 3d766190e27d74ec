// Traces the rays of a file with Embree: reads "mode batch" lines, answers "CPU-seconds hits".
// Modes: 0 default, 1 robust. Single rays, default build quality, flush to zero as Embree advises.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <vector>
#include <xmmintrin.h>
#if EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

static double seconds(clockid_t clock) {
    timespec t;
    clock_gettime(clock, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

struct Input {
    float o[3], t_min, d[3], t_max;
};

static void closest(RTCScene scene, RTCRayHit* ray) {
#if EMBREE == 4
    rtcIntersect1(scene, ray, nullptr);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, ray);
#endif
}

static void any(RTCScene scene, RTCRay* ray) {
#if EMBREE == 4
    rtcOccluded1(scene, ray, nullptr);
#else
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene, &context, ray);
#endif
}

int main(int, char** argv) {
    _mm_setcsr(_mm_getcsr() | 0x8040);
    FILE* file = fopen(argv[1], "rb");
    if (!file) return 1;
    auto word = [&] { uint32_t w = 0; if (fread(&w, 4, 1, file) != 1) exit(1); return w; };
    auto block = [&](auto& v) { if (fread(v.data(), sizeof v[0], v.size(), file) != v.size()) exit(1); };
    uint32_t vertices = word(), triangles = word();
    std::vector<float> positions(3 * size_t(vertices));
    std::vector<uint32_t> indices(3 * size_t(triangles));
    block(positions);
    block(indices);
    std::vector<std::vector<Input>> batches(0);
    std::vector<bool> is_any;
    for (uint32_t n = word(); n--;) {
        is_any.push_back(word());
        batches.emplace_back(word());
        block(batches.back());
    }
    RTCDevice device = rtcNewDevice("threads=1");
    RTCScene scenes[2];
    for (int mode = 0; mode < 2; mode++) {
        double begin = seconds(CLOCK_PROCESS_CPUTIME_ID);
        RTCScene scene = scenes[mode] = rtcNewScene(device);
        if (mode == 1) rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        void* to = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, vertices);
        memcpy(to, positions.data(), 4 * positions.size());
        to = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles);
        memcpy(to, indices.data(), 4 * indices.size());
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene);
        printf("%.3f%s", seconds(CLOCK_PROCESS_CPUTIME_ID) - begin, mode ? "\n" : ", ");
    }
    fflush(stdout);
    unsigned mode, batch;
    while (scanf("%u %u", &mode, &batch) == 2 && mode < 2 && batch < batches.size()) {
        size_t hits = 0;
        double begin = seconds(CLOCK_THREAD_CPUTIME_ID);
        for (const Input& in : batches[batch]) {
            RTCRayHit r;
            r.ray = {in.o[0], in.o[1], in.o[2], in.t_min, in.d[0], in.d[1], in.d[2], 0, in.t_max, ~0u, 0, 0};
            r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
            if (is_any[batch]) {
                any(scenes[mode], &r.ray);
                hits += r.ray.tfar < 0;
            } else {
                closest(scenes[mode], &r);
                hits += r.hit.geomID != RTC_INVALID_GEOMETRY_ID;
            }
        }
        printf("%.9f %zu\n", seconds(CLOCK_THREAD_CPUTIME_ID) - begin, hits);
        fflush(stdout);
    }
}
