// The preview of a course in a panel beside the editor: `coursebuild serve`, at the page of the open file.

const { spawn } = require('node:child_process');
const fs = require('node:fs');
const os = require('node:os');
const path = require('node:path');
const vscode = require('vscode');
const { addressIn, courseOf, pageOf } = require('./course');

// The origins that may show the preview in a frame: the panel, and the window around it.
const EMBED = ['--embed', 'vscode-webview:', '--embed', 'vscode-file:'];

class Preview {
  /** `onEnd` is called when the panel is closed or the preview ends. */
  constructor(folder, command, output, onEnd) {
    this.folder = folder;
    this.panel = vscode.window.createWebviewPanel(
      'coursebuild.preview',
      'Preview',
      { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true },
      { enableScripts: true, retainContextWhenHidden: true },
    );
    this.process = spawn(command, ['-C', folder, 'serve', '--port', '0', ...EMBED], { cwd: os.homedir() });
    this.panel.onDidDispose(() => this.process.kill('SIGINT'));
    this.process.on('error', (error) => output.appendLine(String(error)));
    this.process.on('close', (code) => {
      if (code !== null && code !== 0 && code !== 130) {
        vscode.window.showErrorMessage('The preview has ended.', 'Show Why').then((choice) => choice && output.show());
      }
      this.panel.dispose();
      onEnd();
    });
    let text = '';
    const onOutput = (data) => {
      output.append(String(data));
      text += this.address ? '' : data;
      this.address ??= addressIn(text);
      this.show(vscode.window.activeTextEditor);
    };
    this.process.stdout.on('data', onOutput);
    this.process.stderr.on('data', onOutput);
  }

  /** Show the page of the file in an editor, unless it is shown already. */
  async show(editor) {
    const file = editor?.document.uri.fsPath;
    if (!this.address || (file && (!file.endsWith('.md') || courseOf(file) !== this.folder)) || (!file && this.page)) return;
    const map = fs.readFileSync(path.join(this.folder, 'content', 'course.toml'), 'utf8');
    const page = new URL(this.address); // its token stays
    page.pathname = file ? pageOf(path.relative(this.folder, file).replaceAll(path.sep, '/'), map) : '';
    if (page.href === this.page) return;
    this.page = page.href;
    const address = String(await vscode.env.asExternalUri(vscode.Uri.parse(page.href)));
    this.panel.webview.html = `<!doctype html>
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; frame-src http: https:">
<style>html, body, iframe { width: 100%; height: 100%; margin: 0; padding: 0; border: 0; display: block }</style>
<iframe title="Preview" src="${address.replaceAll('&', '&amp;').replaceAll('"', '&quot;')}" allow="clipboard-write; fullscreen"></iframe>`;
  }
}

module.exports = { Preview };
