// Puts the script of the page into the package, beside its text and its style, with the licences of what others wrote of it.
import { createHash } from "node:crypto";
import fs from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";
import esbuild from "esbuild";

const HERE = path.dirname(fileURLToPath(import.meta.url));
const OUT = process.argv[2] ?? path.join(HERE, "..", "..", "missionc", "tools", "studio", "assets");

const { metafile } = await esbuild.build({
  absWorkingDir: HERE,
  entryPoints: ["src/main.js"],
  outfile: path.join(OUT, "studio.js"),
  bundle: true,
  format: "iife",
  target: ["chrome120", "firefox121", "safari17"],
  minify: true,
  legalComments: "none",
  metafile: true,
  logLevel: "warning",
});

const packages = new Set(
  Object.keys(metafile.inputs).flatMap((file) => /^.*node_modules\/(?:@[^/]+\/)?[^/]+/.exec(file)?.[0] ?? []),
);
fs.writeFileSync(path.join(OUT, "LICENSES.txt"), [...packages].sort().map(licence).join("\n\n"));
fs.writeFileSync(path.join(OUT, "SOURCES.sha256"), `${digest()}\n`);

// The licence that a package names, and its text.
function licence(folder) {
  const { name, version, license } = JSON.parse(fs.readFileSync(path.join(HERE, folder, "package.json"), "utf8"));
  const file = fs.readdirSync(path.join(HERE, folder)).find((entry) => /^licen[cs]e/i.test(entry));
  if (!file) throw new Error(`${folder} has no licence in it`);
  const text = fs.readFileSync(path.join(HERE, folder, file), "utf8").trim();
  return `${name} ${version} (${license})\n\n${text}\n`;
}

// A digest of all that the script is built from, by which a test tells that it was built from these sources.
function digest() {
  const sources = fs.readdirSync(path.join(HERE, "src")).map((name) => `src/${name}`);
  const hash = createHash("sha256");
  for (const name of ["build.js", "package-lock.json", ...sources.sort()]) {
    hash.update(`${name}\n`).update(fs.readFileSync(path.join(HERE, name)));
  }
  return hash.digest("hex");
}
