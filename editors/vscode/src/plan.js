// The schedule of a workflow beside its text.
'use strict';

const { execFile } = require('child_process');
const fs = require('fs/promises');
const os = require('os');
const path = require('path');
const vscode = require('vscode');

function escape(text) {
  return text.replace(/[&<>"]/g, (sign) => ({ '&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;' })[sign]);
}

function page(title, svg, words) {
  const picture = svg ? `<img alt="schedule" src="data:image/svg+xml;base64,${Buffer.from(svg).toString('base64')}">` : '';
  return `<!DOCTYPE html><html><head><meta charset="utf-8"><title>${escape(title)}</title>
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<style>body { padding: 1em } img { background: white; max-width: 100% } pre { font-family: var(--vscode-editor-font-family) }</style>
</head><body>${picture}<pre>${escape(words)}</pre></body></html>`;
}

// Runs a program to its end; fails with what it said.
function finished(command, args, token) {
  return new Promise((resolve, reject) => {
    const child = execFile(command, args, { maxBuffer: 64 << 20 }, (error, stdout, stderr) =>
      error ? reject(new Error(stderr || stdout || error.message)) : resolve(stdout));
    token?.onCancellationRequested(() => child.kill());
  });
}

async function plan(command, uri, output) {
  const folder = await fs.mkdtemp(path.join(os.tmpdir(), 'mtx-'));
  const file = path.join(folder, 'schedule.svg');
  const title = `Schedule of ${path.basename(uri.fsPath)}`;
  const look = { location: vscode.ProgressLocation.Notification, title, cancellable: true };
  try {
    const words = await vscode.window.withProgress(look, (_, token) =>
      finished(command, ['plan', uri.fsPath, '--color', 'never', '--svg', file], token));
    const svg = await fs.readFile(file, 'utf8').catch(() => undefined);
    const panel = vscode.window.createWebviewPanel('mtx.plan', title, vscode.ViewColumn.Beside, {});
    panel.webview.html = page(title, svg, words);
  } catch (error) {
    output.appendLine(error.message);
    if ((await vscode.window.showErrorMessage(`There is no ${title.toLowerCase()}.`, 'Show why')) !== undefined) output.show();
  } finally {
    await fs.rm(folder, { recursive: true, force: true });
  }
}

module.exports = { plan, page };
