// Puts the extension and all it needs into dist/: its code, the page of the map, and the licences of what others wrote of it.
"use strict";

const fs = require("node:fs");
const path = require("node:path");
const esbuild = require("esbuild");

const OUT = path.join(__dirname, "dist");

async function build() {
  const { metafile } = await esbuild.build({
    absWorkingDir: __dirname,
    entryPoints: ["src/extension.js"],
    outfile: "dist/extension.js",
    bundle: true,
    platform: "node",
    target: "node20",
    external: ["vscode"],
    minify: true,
    legalComments: "none",
    metafile: true,
    logLevel: "warning",
  });
  await esbuild.build({
    absWorkingDir: __dirname,
    entryPoints: { map: "map/page.js" },
    outdir: "dist",
    bundle: true,
    format: "iife",
    target: "chrome120",
    minify: true,
    legalComments: "none",
    logLevel: "warning",
  });
  const styles = [path.join(__dirname, "..", "..", "missionc", "tools", "studio", "assets", "studio.css"), path.join(__dirname, "map", "map.css")];
  fs.writeFileSync(path.join(OUT, "map.css"), styles.map((file) => fs.readFileSync(file, "utf8")).join("\n"));
  const packages = new Set(Object.keys(metafile.inputs).flatMap((file) => /^.*node_modules\/(?:@[^/]+\/)?[^/]+/.exec(file) ?? []));
  fs.writeFileSync(path.join(OUT, "LICENSES.txt"), [...packages].sort().map(licence).join("\n\n"));
}

/** @param {string} folder */
function licence(folder) {
  const { name, version, license } = JSON.parse(fs.readFileSync(path.join(__dirname, folder, "package.json"), "utf8"));
  const file = fs.readdirSync(path.join(__dirname, folder)).find((entry) => /^licen[cs]e/i.test(entry));
  if (!file) throw new Error(`${folder} has no licence in it`);
  const text = fs.readFileSync(path.join(__dirname, folder, file), "utf8").trim();
  return `${name} ${version} (${license})\n\n${text}\n`;
}

build();
