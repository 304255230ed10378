// What is known at the cursor, beside the text: what vessels hold, how devices stand, how much time has passed. It follows the cursor.
'use strict';

const vscode = require('vscode');

const SCHEME = 'mtx-contents';
const ADDRESS = vscode.Uri.parse(`${SCHEME}:/At the cursor`);

// So long the cursor has to rest, in ms.
const REST = 120;

class Contents {
  constructor() {
    this.text = '';
    this.changed = new vscode.EventEmitter();
    this.waiting = undefined;
    this.disposables = [
      this.changed,
      vscode.workspace.registerTextDocumentContentProvider(SCHEME, {
        onDidChange: this.changed.event,
        provideTextDocumentContent: () => this.text,
      }),
      vscode.window.onDidChangeTextEditorSelection(({ textEditor }) => {
        if (this.isShown() && textEditor.document.languageId === 'mtx') this.later(textEditor);
      }),
    ];
  }

  isShown() {
    return vscode.window.visibleTextEditors.some(({ document }) => document.uri.scheme === SCHEME);
  }

  later(editor) {
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.update(editor), REST);
  }

  async update(editor) {
    const at = editor.selection.active;
    const hovers = await vscode.commands.executeCommand('vscode.executeHoverProvider', editor.document.uri, at);
    const parts = (hovers ?? []).flatMap(({ contents }) => contents).map((part) => (typeof part === 'string' ? part : part.value));
    const place = `line ${at.line + 1}`;
    this.text = parts.length > 0 ? `${place}\n\n${parts.join('\n\n')}\n` : `${place}: nothing is known here; go to a step of a workflow\n`;
    this.changed.fire(ADDRESS);
  }

  async show() {
    const editor = vscode.window.activeTextEditor;
    if (editor?.document.languageId !== 'mtx') return;
    await this.update(editor);
    const document = await vscode.workspace.openTextDocument(ADDRESS);
    await vscode.languages.setTextDocumentLanguage(document, 'markdown');
    await vscode.window.showTextDocument(document, { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true, preview: false });
  }

  dispose() {
    clearTimeout(this.waiting);
    for (const disposable of this.disposables) disposable.dispose();
  }
}

module.exports = { Contents };
