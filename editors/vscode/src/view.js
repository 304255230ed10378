// The lab in three dimensions, on the page that matterixc serves.
'use strict';

const { spawn } = require('child_process');
const vscode = require('vscode');

const ADDRESS = /https?:\/\/[0-9A-Za-z.:[\]]+\/?\S*/;

// One server of a page for each file, until the editor is closed.
class View {
  constructor(output) {
    this.output = output;
    this.servers = new Map();
  }

  open(command, uri) {
    this.servers.get(uri.fsPath)?.kill();
    const child = spawn(command, ['view', uri.fsPath, '--color', 'never'], { stdio: ['ignore', 'pipe', 'pipe'] });
    this.servers.set(uri.fsPath, child);
    let said = '';
    let shown = false;
    const listen = (piece) => {
      this.output.append(String(piece));
      said += piece;
      const address = said.match(new RegExp(`${ADDRESS.source}(?=\\s)`));
      if (shown || !address) return;
      shown = true;
      vscode.env.openExternal(vscode.Uri.parse(address[0]));
    };
    child.stdout.on('data', listen);
    child.stderr.on('data', listen);
    child.on('error', (error) => this.failed(error.message));
    child.on('close', (code) => {
      if (this.servers.get(uri.fsPath) === child) this.servers.delete(uri.fsPath);
      if (!shown && code) this.failed(said);
    });
    return child;
  }

  async failed(why) {
    this.output.appendLine(why);
    if ((await vscode.window.showErrorMessage('The lab cannot be shown.', 'Show why')) !== undefined) this.output.show();
  }

  dispose() {
    for (const child of this.servers.values()) child.kill();
    this.servers.clear();
  }
}

module.exports = { View };
