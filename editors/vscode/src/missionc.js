// What the extension knows of missionc, without a word of VS Code: how it is called, and why it does not come up.
"use strict";

const path = require("node:path");

const INSTALL = "pip install 'missionc[lsp]'";

/**
 * The program that the setting `missionc.path` names: `~` is the home folder, `${workspaceFolder}` the one that is open,
 * and a path with a separator in it starts there. A bare name is looked up by the system.
 *
 * @param {string} setting
 * @param {string | undefined} folder
 * @param {string} home
 */
function programPath(setting, folder, home) {
  const named = setting.trim() || "missionc";
  const whole = named.replace(/^~(?=[\\/])/, () => home).replaceAll("${workspaceFolder}", () => folder ?? "");
  return /[\\/]/.test(whole) && folder ? path.resolve(folder, whole) : whole;
}

function serverArguments() {
  return ["lsp"];
}

/** `--force` replaces what an earlier run wrote, and nothing else. @param {string} file */
function compileArguments(file) {
  return ["compile", file, "--force"];
}

/** The commands that the server may offer above the text. @param {boolean} trusted whether the folder is, so that it may be compiled */
function lensCommands(trusted) {
  return [...(trusted ? ["missionc.compile"] : []), "missionc.showReport", "missionc.showMap"];
}

/** What a mission is called, and with it its folder in build/; empty where the text does not say. @param {string} text */
function missionName(text) {
  const words = text.replace(/"[^"\n]*"|#[^\n]*/g, " ");
  return /(?<!\w)mission\s+([A-Za-z_]\w*)/.exec(words)?.[1] ?? "";
}

/** Why there is no language server, and the way out. @param {string} program */
function whyNot(program) {
  const command = [program, ...serverArguments()].join(" ");
  return `\`${command}\` did not start. Install it with ${INSTALL}, or set missionc.path to its path.`;
}

module.exports = { INSTALL, compileArguments, lensCommands, missionName, programPath, serverArguments, whyNot };
