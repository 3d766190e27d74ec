// A picture of 16 x 8: red left, green right above, blue below right, alpha falling to the right; as KTX2 in both codecs.
import { encodeToKTX2 } from "ktx2-encoder";
import { writeFileSync } from "node:fs";
const [width, height] = [16, 8];
const data = new Uint8Array(4 * width * height);
for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) {
  const colour = x < 8 ? [200, 30, 20] : y < 4 ? [20, 180, 40] : [30, 60, 220];
  data.set([...colour, x < 8 ? 255 : 128], 4 * (y * width + x));
}
const imageDecoder = async () => ({ data, width, height });
for (const [name, isUASTC] of [["etc1s", false], ["uastc", true]]) {
  const bytes = await encodeToKTX2(new Uint8Array(8), { isUASTC, imageDecoder, generateMipmap: false, needSupercompression: true, isKTX2File: true, qualityLevel: 255, isPerceptual: true, isSetKTX2SRGBTransferFunc: true });
  writeFileSync(`${name}.ktx2`, bytes);
  console.log(name, bytes.length);
}
