// Where a Chromium is: what the variable CHROMIUM names, or what PATH finds.
import assert from "node:assert/strict";
import { accessSync, constants } from "node:fs";
import { delimiter, join } from "node:path";

export function findChromium() {
  const names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
  const places = (process.env.PATH ?? "").split(delimiter).flatMap((dir) => names.map((name) => join(dir, name)));
  const found = (process.env.CHROMIUM ? [process.env.CHROMIUM] : places).find((path) => {
    try {
      accessSync(path, constants.X_OK);
      return true;
    } catch {
      return false;
    }
  });
  assert(found, "no Chromium: install Debian's `chromium`, or name one by the variable CHROMIUM");
  return found;
}
