// Makes dist/coursebuild.vsix: the extension with the packages that it needs, and their licences.

import { execFileSync } from 'node:child_process';
import { readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { build } from 'esbuild';

const { metafile } = await build({
  entryPoints: ['src/extension.js'],
  outfile: 'dist/extension.js',
  bundle: true,
  minify: true,
  platform: 'node',
  target: 'node20',
  external: ['vscode'],
  metafile: true,
});
const names = Object.keys(metafile.inputs).map((path) => /^node_modules\/((?:@[^/]+\/)?[^/]+)/.exec(path)?.[1]);
const licences = [...new Set(names.filter(Boolean))].sort().map((name) => {
  const file = readdirSync(`node_modules/${name}`).find((entry) => /^licen[cs]e/i.test(entry));
  if (!file) throw new Error(`${name} has no licence file`);
  return `${name}\n\n${readFileSync(`node_modules/${name}/${file}`, 'utf8')}`;
});
writeFileSync('LICENSE', [readFileSync('../../LICENSE', 'utf8'), ...licences].join(`\n${'-'.repeat(80)}\n\n`));
const vsce = ['--yes', '@vscode/vsce@4.1.0', 'package', '--no-dependencies', '--out', 'dist/coursebuild.vsix'];
execFileSync('npx', [...vsce, '--allow-missing-repository'], { stdio: 'inherit' });
