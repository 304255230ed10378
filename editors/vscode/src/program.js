// Where matterixc is, and what to say where it is not.
'use strict';

const { execFile } = require('child_process');
const fs = require('fs');
const os = require('os');
const path = require('path');
const vscode = require('vscode');

// So long a program may take to say how it is used, in ms.
const PATIENCE = 10_000;

function isProgram(file) {
  try {
    fs.accessSync(file, fs.constants.X_OK);
    return fs.statSync(file).isFile();
  } catch {
    return false;
  }
}

// The path of a program, by its path or by its name on the PATH; undefined where there is none. A relative path would depend on
// where the editor was started and is none.
function locate(wanted) {
  const name = wanted.startsWith('~/') ? path.join(os.homedir(), wanted.slice(2)) : wanted;
  const endings = process.platform === 'win32' ? ['', '.exe'] : [''];
  const folders = path.isAbsolute(name) ? [''] : name.includes('/') || name.includes(path.sep) ? [] : (process.env.PATH ?? '').split(path.delimiter);
  const files = folders.filter((folder) => path.isAbsolute(name) || path.isAbsolute(folder)).map((folder) => path.join(folder, name));
  return files.flatMap((file) => endings.map((ending) => file + ending)).find(isProgram);
}

// Whether a program does what these arguments ask for at all; older ones do not.
function understands(command, args) {
  return new Promise((resolve) => {
    execFile(command, [...args, '--help'], { timeout: PATIENCE }, (error) => resolve(!error));
  });
}

async function missing(wanted) {
  const text = `\`${wanted}\` was not found. Install matterixc with \`cargo install\`, or say in the settings where it is.`;
  if ((await vscode.window.showErrorMessage(text, 'Open the setting')) !== undefined) {
    await vscode.commands.executeCommand('workbench.action.openSettings', 'mtx.server.path');
  }
}

module.exports = { locate, missing, understands };
