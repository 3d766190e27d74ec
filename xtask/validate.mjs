// Validates glTF files with Khronos' validator: node xtask/validate.mjs FILE...
// Needs the npm package gltf-validator in a node_modules folder that NODE_PATH names.
// Prints a line a file; exits 1 if any has an error or a warning.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

// An import statement would not look into NODE_PATH; require does.
const validator = createRequire(import.meta.url)("gltf-validator");
let bad = 0;
for (const path of process.argv.slice(2)) {
  const { issues, info } = await validator.validateBytes(new Uint8Array(readFileSync(path)));
  console.log(`${path}: ${issues.numErrors} errors, ${issues.numWarnings} warnings, ${info.totalTriangleCount} triangles`);
  for (const { severity, code, message, pointer } of issues.messages) {
    console.log(`  ${["error", "warning", "info", "hint"][severity]} ${code} at ${pointer}: ${message}`);
  }
  bad += issues.numErrors + issues.numWarnings;
}
process.exit(bad > 0 ? 1 : 0);
