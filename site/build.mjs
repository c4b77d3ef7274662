/**
 * Bundles the browser's half of coursebuild into one folder of finished files.
 *
 *   node build.mjs OUT
 *
 * Sources are the js/, css/ and licences/ folders beside this file. In OUT, in this order:
 *
 *   js/NAME.js           one ES module for each js/NAME.js; of js/NAME-trial.js a classic script for V8 without a page
 *   css/NAME.css         css/site.css with its imports, and css/preview.css, css/scorm.css and css/slides.css, which only the preview,
 *                        packages and slides have
 *   mujoco/mujoco.wasm   the physics engine of js/lab-worker.js and js/lab-trial.js
 *   temml/temml.min.js   a classic script that defines the global `temml`, with chemistry (`\ce`, `\pu`)
 *   fonts/*.woff2        and fonts.json, which says what each file holds (see `readFaces`)
 *   licences/NAME.txt    the licence of every package of which a part is in OUT
 *
 * The same sources and packages give the same bytes. A mistake ends the process with status 1 and one message.
 */

import { build } from 'esbuild'
import { existsSync } from 'node:fs'
import { copyFile, mkdir, readFile, readdir, writeFile } from 'node:fs/promises'
import { basename, dirname, join, resolve } from 'node:path'
import { fileURLToPath } from 'node:url'

const HERE = dirname(fileURLToPath(import.meta.url))

const LATIN = ['latin', 'latin-ext', 'vietnamese']
const ALL = [...LATIN, 'greek', 'cyrillic']

/**
 * The fonts: the package of each, and of each of its style sheets the subsets to take.
 * `whole` marks a font that is one file, whose unicode-range names only a part of the file's characters.
 */
const FONTS = [
  {
    name: '@fontsource-variable/source-serif-4',
    sheets: { 'opsz.css': ALL, 'opsz-italic.css': ALL },
    whole: false,
  },
  { name: '@fontsource-variable/source-sans-3', sheets: { 'wght.css': ALL }, whole: false },
  {
    // Its italics have no Greek and no Cyrillic letters, though the package has files of those names.
    name: '@fontsource-variable/source-code-pro',
    sheets: { 'wght.css': ALL, 'wght-italic.css': LATIN },
    whole: false,
  },
  { name: '@fontsource/stix-two-math', sheets: { '400.css': ['latin'] }, whole: true },
]

/** Whether a script is for a bare V8, which has neither modules nor URLs. */
const isTrial = (file) => file.endsWith('-trial.js')

/** A mistake in the sources or the packages, reported without a stack. */
class BuildError extends Error {}

/** The folder of an installed package, searched as Node does, in each node_modules from here upwards. */
function packageFolder(name) {
  for (let folder = HERE; ; folder = dirname(folder)) {
    const candidate = join(folder, 'node_modules', name)
    if (existsSync(join(candidate, 'package.json'))) return candidate
    if (folder === dirname(folder)) throw new BuildError(`the npm package ${name} is not installed`)
  }
}

/** The names of the packages of which esbuild took a file, from its metafile. */
function bundledPackages(metafile) {
  const names = new Set()
  for (const [path, input] of Object.entries(metafile.inputs)) {
    const match = /.*(?:^|\/)node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(path)
    if (match && input.bytes > 0) names.add(match[1])
  }
  return names
}

async function bundle(options) {
  try {
    const result = await build({
      absWorkingDir: HERE,
      bundle: true,
      minify: true,
      charset: 'utf8',
      legalComments: 'eof',
      logLevel: 'warning',
      metafile: true,
      ...options,
    })
    if (result.warnings.length > 0) throw new BuildError('esbuild gave warnings')
    return bundledPackages(result.metafile)
  } catch (error) {
    if (error.errors) throw new BuildError('esbuild found errors') // which it has printed
    throw error
  }
}

/** Removes the branch for Node from the engine's glue: no bundle needs it, and it cannot be bundled for a page. */
const withoutNode = {
  name: 'without-node',
  setup(building) {
    building.onLoad({ filter: /@mujoco\/mujoco\/mujoco\.js$/ }, async ({ path }) => {
      const source = await readFile(path, 'utf8')
      const [start, end, ...rest] = source.split(/^var ENVIRONMENT_IS_NODE = .*$/m)
      if (end === undefined || rest.length > 0) throw new Error('ENVIRONMENT_IS_NODE is not defined as expected')
      return { contents: (start + end).replaceAll(/\bENVIRONMENT_IS_NODE\b/g, 'false'), loader: 'js' }
    })
  },
}

async function bundleScripts(out) {
  const folder = join(HERE, 'js')
  const files = existsSync(folder) ? (await readdir(folder)).sort() : []
  const entries = files.filter((file) => file.endsWith('.js') && !file.endsWith('.test.js'))
  if (entries.length === 0) throw new BuildError('site/js holds no script: nothing to bundle')
  const options = { outdir: join(out, 'js'), platform: 'browser', target: 'es2022', plugins: [withoutNode] }
  const names = new Set()
  for (const [format, group, define] of [
    ['esm', entries.filter((file) => !isTrial(file)), {}],
    ['iife', entries.filter(isTrial), { 'import.meta.url': '"file:///engine.js"' }],
  ]) {
    if (group.length === 0) continue
    const entryPoints = group.map((file) => join('js', file))
    for (const name of await bundle({ ...options, entryPoints, format, define })) names.add(name)
  }
  return names
}

async function bundleStyles(out) {
  if (!existsSync(join(HERE, 'css', 'site.css'))) {
    throw new BuildError('site/css/site.css is missing: nothing to bundle')
  }
  return bundle({
    entryPoints: ['site.css', 'preview.css', 'scorm.css', 'slides.css'].map((file) => join('css', file)).filter((file) => existsSync(join(HERE, file))),
    outdir: join(out, 'css'),
    external: ['*.woff2'], // the site writes its own @font-face rules, for the subsets that it makes
    loader: { '.svg': 'dataurl' },
  })
}

async function copyTemml(out) {
  const target = join(out, 'temml', 'temml.min.js')
  await mkdir(dirname(target), { recursive: true })
  const chemistry = join(packageFolder('temml'), 'contrib', 'mhchem')
  const [notice] = /\/\*{9}[\s\S]*?\*\/\n/.exec(await readFile(join(chemistry, 'mhchem.js'), 'utf8')) // it has a licence of its own
  const parts = [join(packageFolder('temml'), 'dist', 'temml.min.js'), join(chemistry, 'mhchem.min.js')]
  const [temml, mhchem] = await Promise.all(parts.map((path) => readFile(path, 'utf8')))
  await writeFile(target, `${temml}\n${notice}${mhchem}`)
}

async function copyEngine(out) {
  const target = join(out, 'mujoco', 'mujoco.wasm')
  await mkdir(dirname(target), { recursive: true })
  await copyFile(join(packageFolder('@mujoco/mujoco'), 'mujoco.wasm'), target)
}

/** The value of one descriptor of an @font-face rule. */
function descriptor(rule, name) {
  const match = new RegExp(`(?:^|[;{\\s])${name}\\s*:\\s*([^;}]+)`).exec(rule)
  if (!match) throw new BuildError(`an @font-face rule has no ${name}`)
  return match[1].trim()
}

/**
 * The faces of a font, from the style sheets of its package, in the form of fonts.json:
 * {family, subset, file, style, weight: [min, max], unicode_range: text or null for the whole font}.
 */
async function readFaces(font) {
  const folder = packageFolder(font.name)
  const faces = []
  for (const [sheet, subsets] of Object.entries(font.sheets)) {
    const css = await readFile(join(folder, sheet), 'utf8')
    const rules = [...css.matchAll(/@font-face\s*\{[^}]*\}/g)].map(([rule]) => rule)
    for (const subset of subsets) {
      const name = new RegExp(`url\\(\\./files/(${basename(font.name)}-${subset}-[a-z0-9]+-[a-z]+\\.woff2)\\)`)
      const matches = rules.filter((rule) => name.test(rule))
      if (matches.length !== 1) {
        throw new BuildError(`${font.name}/${sheet} has ${matches.length} faces for ${subset}, not 1`)
      }
      faces.push(readFace(matches[0], subset, name.exec(matches[0])[1], font.whole))
    }
  }
  return faces
}

function readFace(rule, subset, file, whole) {
  const [min, max] = descriptor(rule, 'font-weight').split(/\s+/).map(Number)
  return {
    family: descriptor(rule, 'font-family').replace(/^(['"])(.*)\1$/, '$2'),
    subset,
    file,
    style: descriptor(rule, 'font-style'),
    weight: [min, max ?? min],
    unicode_range: whole ? null : descriptor(rule, 'unicode-range'),
  }
}

async function copyFonts(out) {
  await mkdir(join(out, 'fonts'), { recursive: true })
  const faces = []
  for (const font of FONTS) {
    for (const face of await readFaces(font)) {
      await copyFile(join(packageFolder(font.name), 'files', face.file), join(out, 'fonts', face.file))
      faces.push(face)
    }
  }
  await writeFile(join(out, 'fonts', 'fonts.json'), JSON.stringify(faces, null, 2) + '\n')
}

/** Copy the licence of each package: "@scope/name" becomes scope-name.txt. licences/ holds those that a package lacks. */
async function copyLicences(names, out) {
  await mkdir(join(out, 'licences'), { recursive: true })
  for (const name of [...names].sort()) {
    const folder = packageFolder(name)
    const file = (await readdir(folder)).sort().find((entry) => /^(licen[cs]e|copying)(\.(md|txt))?$/i.test(entry))
    const target = name.replace('@', '').replace('/', '-') + '.txt'
    const source = file === undefined ? join(HERE, 'licences', target) : join(folder, file)
    if (!existsSync(source)) throw new BuildError(`the npm package ${name} has no licence file`)
    await copyFile(source, join(out, 'licences', target))
  }
}

async function main(args) {
  if (args.length !== 1) throw new BuildError('usage: node build.mjs OUT')
  const out = resolve(args[0])
  const shipped = new Set(['temml', '@mujoco/mujoco', ...FONTS.map((font) => font.name)])
  for (const name of await bundleScripts(out)) shipped.add(name)
  for (const name of await bundleStyles(out)) shipped.add(name)
  await copyTemml(out)
  await copyEngine(out)
  await copyFonts(out)
  await copyLicences(shipped, out)
}

try {
  await main(process.argv.slice(2))
} catch (error) {
  if (!(error instanceof BuildError)) throw error
  console.error(`site/build.mjs: ${error.message}`)
  process.exitCode = 1
}
