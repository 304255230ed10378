// Bundles the extension, with the licences of what goes into the bundle beside it.
'use strict';

const esbuild = require('esbuild');
const fs = require('fs');
const path = require('path');

const DIST = path.join(__dirname, 'dist');

async function main() {
  const { metafile } = await esbuild.build({
    absWorkingDir: __dirname,
    entryPoints: ['src/extension.js'],
    bundle: true,
    platform: 'node',
    target: 'node18',
    format: 'cjs',
    external: ['vscode'],
    minify: true,
    metafile: true,
    outfile: 'dist/extension.js',
    logLevel: 'warning',
  });
  const packages = new Set(Object.keys(metafile.inputs).map((file) => file.match(/^node_modules\/((?:@[^/]+\/)?[^/]+)/)?.[1]).filter(Boolean));
  const notices = [...packages].sort().map((name) => {
    const folder = path.join(__dirname, 'node_modules', name);
    const { version, license } = JSON.parse(fs.readFileSync(path.join(folder, 'package.json'), 'utf8'));
    const file = fs.readdirSync(folder).find((entry) => /^licen[cs]e/i.test(entry));
    if (!file) throw new Error(`${name} comes without a licence`);
    return `${name} ${version} (${license})\n\n${fs.readFileSync(path.join(folder, file), 'utf8').trim()}\n`;
  });
  fs.writeFileSync(path.join(DIST, 'notices.txt'), notices.join(`\n${'-'.repeat(80)}\n\n`));
  for (const name of ['LICENSE-MIT', 'LICENSE-APACHE']) fs.copyFileSync(path.join(__dirname, '../..', name), path.join(DIST, name));
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});
