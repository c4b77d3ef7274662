/**
 * Typesets formulas with Temml and its mhchem, whose global `temml` is loaded before this script.
 *
 *   typeset(json)   json: [{tex, source, display}, …]; returns as JSON, for each, its MathML (a string) or
 *                   {message, position}, position being an offset in UTF-16 units into source, what
 *                   the author wrote, or null
 *
 * 1. What KaTeX and MathJax take and Temml does not is written as Temml takes it.
 * 2. Temml makes a tree of MathML nodes, or throws.
 * 3. The tree is mended where Temml's output is not valid HTML, and refused where it cannot be right:
 *    references that a script in the page would have to fill, colours and lengths that do not exist.
 * 4. The tree becomes text.
 */

'use strict'

const typeset = (() => {
  const MAX_SOURCE = 20_000 // UTF-16 units of TeX
  const MAX_MARKUP = 1_000_000 // UTF-16 units of MathML
  const MAX_DEPTH = 150 // nested elements; browsers flatten what is deeper than a few hundred

  const OPTIONS = { throwOnError: true, trust: false, strict: false, annotate: true, maxExpand: 1000 }

  // Commands of LaTeX, MathJax and KaTeX that Temml lacks, or has under another name; a function reads its own arguments.
  const MACROS = {
    '\\DeclareMathOperator': '\\@ifstar{\\@operator*}{\\@operator{}}',
    '\\@operator': '\\def#2{\\operatorname#1{#3}}',
    '\\abs': '\\@ifstar\\@abs\\@abs',
    '\\@abs': '\\left\\lvert #1\\right\\rvert',
    '\\norm': '\\@ifstar\\@norm\\@norm',
    '\\@norm': '\\left\\lVert #1\\right\\rVert',
    '\\dd': (context) => `\\mathrm{d}${readPower(context)}`,
    '\\dv': (context) => derivative('\\mathrm{d}', context),
    '\\pdv': (context) => derivative('\\partial', context),
    '\\braket': (context) => `\\mathinner{\\langle{${readBracket(context)}}\\rangle}`,
    '\\Braket': (context) => `\\left\\langle{${readBracket(context).replace(/(?<!\\)\|/g, '}\\,\\middle|\\,{')}}\\right\\rangle`,
    '\\ketbra': '\\ket{#1}\\!\\bra{#2}',
    '\\vb': '\\@ifstar\\boldsymbol\\mathbf',
    '\\cross': '\\times',
    '\\grad': '\\nabla',
    '\\curl': '\\grad\\times',
    '\\laplacian': '\\nabla^2',
    '\\tr': '\\operatorname{tr}',
    '\\Tr': '\\operatorname{Tr}',
    '\\mbox': '\\text{#1}',
    '\\mathds': '\\mathbb{#1}',
    '\\mathbbm': '\\mathbb{#1}',
    '\\R': '\\mathbb{R}',
    '\\N': '\\mathbb{N}',
    '\\Z': '\\mathbb{Z}',
    '\\textdegree': '\\degree',
    '\\KaTeX': '\\text{KaTeX}',
    '\\hfill': '', // by which LaTeX places what a cell of an array holds
    '\\hfil': '',
  }
  for (const name in MACROS) temml.__defineMacro(name, MACROS[name])

  /** TeX of tokens that are yet to be read, the last one first. */
  const texOf = (tokens) => tokens.map(({ text }) => (/^\\[A-Za-z@]+$/.test(text) ? `${text} ` : text)).reverse().join('')

  /** An exponent from what stands in square brackets, if anything does. */
  function readPower(context) {
    context.consumeSpaces()
    if (context.future().text !== '[') return ''
    context.popToken()
    return `^{${texOf(context.consumeArg([']']).tokens)}}`
  }

  /** An argument, and more of them as long as there are braces. */
  function readArguments(context, most) {
    const values = []
    do {
      values.push(texOf(context.consumeArg().tokens))
      context.consumeSpaces()
    } while (values.length < most && context.future().text === '{')
    return values
  }

  /** What stands in a bracket of Dirac's: `{a|b}`, or `{a}{b}`. */
  function readBracket(context) {
    const [left] = readArguments(context, 1)
    return left.includes('|') || context.future().text !== '{' ? left : `${left}|${readArguments(context, 1)[0]}`
  }

  /** A derivative: `\dv{x}`, `\dv[2]{f}{x}`, `\pdv{f}{x}{y}`; in LaTeX's `derivative` it is `\pdv{f}{x,y}`. */
  function derivative(sign, context) {
    const star = context.future().text === '*' && context.popToken()
    let power = readPower(context)
    const values = readArguments(context, 3)
    const of = values.length > 1 ? values.shift() : ''
    const variables = values.flatMap((value) => value.split(','))
    if (variables.length > 1) power = `^{${variables.length}}`
    const below = variables.map((name) => `${sign} ${name}`).join('\\,') + (variables.length > 1 ? '' : power)
    return star ? `\\frac{${sign}${power}}{${below}}{${of}}` : `\\frac{${sign}${power}{${of}}}{${below}}`
  }

  // What no macro can replace: the name of an environment, the columns of an array, a font's name as an index.
  const REWRITES = [
    // A formula may define a name that is defined here, and leave out its backslash, as MathJax lets it.
    [
      /\\(new|provide)command\*?\s*(?:\{\s*\\?([A-Za-z]+)\s*\}|\\([A-Za-z]+))/g,
      (command, kind, inner, bare) => {
        const name = `\\${inner ?? bare}`
        return kind === 'new' || name in MACROS ? `\\providecommand{${name}}{}\\renewcommand{${name}}` : command
      },
    ],
    [/\\DeclareMathOperator(\*?)\s*\{\s*([A-Za-z]+)\s*\}/g, (_, star, name) => `\\DeclareMathOperator${star}{\\${name}}`],
    [/\\begin\{eqnarray\*?\}/g, () => '\\begin{array}{rcl}'],
    [/\\end\{eqnarray\*?\}/g, () => '\\end{array}'],
    [/\\(begin|end)\{flalign(\*?)\}/g, (_, edge, star) => `\\${edge}{align${star}}`],
    [/\\root(?![A-Za-z])((?:(?!\\root).)*?)\\of(?![A-Za-z])/gs, (_, index) => `\\sqrt[${index.trim()}]`],
    [/\\unicode\s*\{x([0-9A-Fa-f]+)\}/g, (_, number) => `\\char"${number} `],
    [/\\(begin|end)\{split\}/g, (_, edge) => `\\${edge}{aligned}`], // which may also stand in a line
    [/\\(?:begin|end)\{(?:math|displaymath)\}|\\(?:require|vspace\*?)\{[^{}]*\}/g, () => ''],
    [/(\\begin\{array\})(?:\[[tcb]\])?\{((?:[^{}]|\{(?:[^{}]|\{[^{}]*\})*\})*)\}/g, (_, begin, columns) => `${begin}{${plainColumns(columns)}}`],
    [/([_^])\s*\\(rm|bf|it|sf|tt|cal)\s*(?=\{)/g, (_, mark, font) => `${mark}\\math${font}`],
    [/([_^])\s*(\\(?:arg|deg|det|dim|exp|gcd|inf|ker|lim|ln|log|max|min|Pr|sup|sin|cos|tan))(?![A-Za-z])/g, (_, mark, name) => `${mark}{${name}}`],
    // In a text these are characters; but `#1` in the text of a macro is what it is given.
    [
      /\\(?:mbox|text(?:tt|rm|sf|bf|it)?)\{(?:[^{}$\\]|\\[^A-Za-z])*\}/g,
      (text, _, tex) => {
        const mark = /\\(?:def|[a-z]*command)(?![A-Za-z])/.test(tex) ? /\\.|[_&]|#(?![1-9])/g : /\\.|[_&#]/g
        return text.replace(mark, (sign) => (sign.length > 1 ? sign : `\\${sign}`))
      },
    ],
    // Temml takes a bracket of a fixed size for half of a pair, though any other may close it.
    [/(\\[bB]igg?[lm]?)\s*\(/g, (_, size) => `${size}\\lparen `],
    [/(\\[bB]igg?[lm]?)\s*\[/g, (_, size) => `${size}\\lbrack `],
  ]

  /** The columns of an array without the spaces, widths and commands of LaTeX's `array` package; `*{3}{c}` is `ccc`. */
  function plainColumns(columns) {
    return columns
      .replace(/\*\s*\{?\s*(\d{1,2})\s*\}?\s*(?:\{([^{}]*)\}|([lcr]))/g, (_, count, many, one) => (many ?? one).repeat(Number(count)))
      .replace(/[@!<>]\s*\{(?:[^{}]|\{[^{}]*\})*\}/g, '')
      .replace(/[pmb]\s*\{[^{}]*\}/g, 'l')
  }

  // Temml lets any word pass as a colour. These are the names of CSS Color Module Level 4.
  const COLOURS = new Set(
    (
      'aliceblue antiquewhite aqua aquamarine azure beige bisque black blanchedalmond blue blueviolet brown ' +
      'burlywood cadetblue chartreuse chocolate coral cornflowerblue cornsilk crimson cyan darkblue darkcyan ' +
      'darkgoldenrod darkgray darkgreen darkgrey darkkhaki darkmagenta darkolivegreen darkorange darkorchid ' +
      'darkred darksalmon darkseagreen darkslateblue darkslategray darkslategrey darkturquoise darkviolet ' +
      'deeppink deepskyblue dimgray dimgrey dodgerblue firebrick floralwhite forestgreen fuchsia gainsboro ' +
      'ghostwhite gold goldenrod gray green greenyellow grey honeydew hotpink indianred indigo ivory khaki ' +
      'lavender lavenderblush lawngreen lemonchiffon lightblue lightcoral lightcyan lightgoldenrodyellow ' +
      'lightgray lightgreen lightgrey lightpink lightsalmon lightseagreen lightskyblue lightslategray ' +
      'lightslategrey lightsteelblue lightyellow lime limegreen linen magenta maroon mediumaquamarine ' +
      'mediumblue mediumorchid mediumpurple mediumseagreen mediumslateblue mediumspringgreen ' +
      'mediumturquoise mediumvioletred midnightblue mintcream mistyrose moccasin navajowhite navy oldlace ' +
      'olive olivedrab orange orangered orchid palegoldenrod palegreen paleturquoise palevioletred ' +
      'papayawhip peachpuff peru pink plum powderblue purple rebeccapurple red rosybrown royalblue ' +
      'saddlebrown salmon sandybrown seagreen seashell sienna silver skyblue slateblue slategray slategrey ' +
      'snow springgreen steelblue tan teal thistle tomato transparent turquoise violet wheat white ' +
      'whitesmoke yellow yellowgreen currentcolor inherit'
    ).split(' '),
  )

  // Characters that an HTML page must not hold: controls but for white space, and what Unicode keeps unassigned for good.
  const FORBIDDEN = /(?![\t\n\f\r])[\p{Cc}\p{Noncharacter_Code_Point}\p{Cs}]/u

  /** A formula that Temml takes and we do not. */
  class Refusal extends Error {}

  /** Whether a text holds nothing forbidden, as can be seen without the tables of Unicode; most texts are one letter. */
  function isPlain(text) {
    for (let i = 0; i < text.length; i++) {
      const unit = text.charCodeAt(i)
      if (unit < 0x20 || (unit > 0x7e && unit < 0xa0) || unit > 0xd7ff) return false
    }
    return true
  }

  const isForbidden = (text) => !isPlain(text) && FORBIDDEN.test(text)

  function checkValue(name, value) {
    if (/Infinity|NaN/.test(value)) throw new Refusal('a length is not a number')
    if (!/^[\w\s.,%#()+-]*$/.test(value)) throw new Refusal(`\`${value}\` is not a value of ${name}`)
    if (/colou?r|background/i.test(name) && !/^#[0-9a-f]{3,8}$/i.test(value) && !COLOURS.has(value.toLowerCase())) {
      throw new Refusal(`there is no colour \`${value}\``)
    }
  }

  const CHECKED = new Set(
    'width height depth voffset lspace rspace mathsize mathcolor mathbackground'.split(' '),
  )

  function checkAttributes({ style, attributes }) {
    for (const name in style) {
      if (style[name] === undefined) delete style[name] // `\cancelto` has the colour of its text, even where none is set
      else checkValue(name, String(style[name]))
    }
    for (const name in attributes) if (CHECKED.has(name)) checkValue(name, String(attributes[name]))
  }

  /** MathML Core allows these two on every element, and the HTML checker only on mstyle. */
  function mendStyleAttributes(node) {
    const { displaystyle, scriptlevel, ...others } = node.attributes
    if ((displaystyle === undefined && scriptlevel === undefined) || /^(mstyle|mtable|math)$/.test(node.type)) return
    if (node.type === 'mrow') {
      node.type = 'mstyle'
      return
    }
    const inner = new node.constructor('mstyle', node.children)
    if (scriptlevel !== undefined) inner.setAttribute('scriptlevel', scriptlevel)
    if (displaystyle !== undefined) inner.setAttribute('displaystyle', displaystyle)
    node.attributes = others
    node.children = [inner]
  }

  /** Temml gives a cell that is not written the state of its typesetter as a style, padding and borders included. */
  function mendCell(node) {
    const styles = Object.entries(node.style).filter(([name]) => /^(?:padding|border)/.test(name))
    node.style = Object.fromEntries(styles)
  }

  /** Bold digits, for which Temml asks for a font of text, are characters of their own, as bold letters are. */
  function mendDigits(node) {
    const { 'font-family': family, 'font-weight': weight, ...others } = node.style
    if (family === undefined) return
    node.style = others
    const text = node.children[0]?.children?.[0]
    if (weight !== 'bold' || text?.text === undefined) return
    text.text = text.text.replace(/[0-9]/g, (digit) => String.fromCodePoint(0x1d7ce + Number(digit)))
    node.style = {}
  }

  // What reaches no further below its line than a descender does.
  const SHALLOW = new Set(['mi', 'mn', 'mo', 'mtext', 'mspace', 'mrow', 'mstyle', 'msup', 'mover'])
  const LARGE = /[∏∐∑∫-∳⨀-⨜]/

  const isShallow = ({ type, text, children = [] }) =>
    text !== undefined ? !LARGE.test(text) : (type === undefined || SHALLOW.has(type)) && children.every(isShallow)

  /**
   * Browsers hang a radical at the line over what is in it. The smallest one of the font is made for what is as high as a capital
   * letter: over a lower one it would hang below the line of text.
   */
  function mendRoot(node) {
    const [inside, ...index] = node.children
    if (inside === undefined || !isShallow(inside)) return
    const strut = new node.constructor('mspace', [])
    strut.setAttribute('width', '0em')
    strut.setAttribute('height', '0.7em')
    node.children = [new node.constructor('mrow', [inside, strut]), ...index]
  }

  /** Whether a node becomes no markup at all: a fragment of nothing. */
  function isNothing(node) {
    return node.type === undefined && !node.text && (node.children ?? []).every(isNothing)
  }

  function mend(node, depth) {
    if (depth > MAX_DEPTH) throw new Refusal('it is nested too deeply')
    if (node.text !== undefined) {
      // A negated relation is one character where Unicode has one.
      if (node.text.includes('\u0338')) node.text = node.text.normalize('NFC')
      if (isForbidden(node.text)) throw new Refusal('it makes a character that a page must not hold')
      return
    }
    if (node.href !== undefined) throw new Refusal('a formula refers to no other one; write `[](#eq:name)` in the text')
    if (node.type === 'mtd' && node.style.constructor !== Object) mendCell(node)
    if (node.type === 'mstyle') mendDigits(node)
    checkAttributes(node)
    if (node.attributes !== undefined) {
      delete node.attributes.id // a label: nothing may refer to it, and it could be the id of a heading
      if (node.type !== undefined) mendStyleAttributes(node)
    }
    if (!Array.isArray(node.children)) node.children = [] // as Temml's own toMarkup takes it
    for (const child of node.children) mend(child, depth + 1)
    if (node.type === 'msqrt' || node.type === 'mroot') mendRoot(node)
    if (node.type === 'semantics' && node.children.slice(0, -1).every(isNothing)) throw new Refusal('it is empty')
  }

  /**
   * Temml's message without the position and the excerpt that follow it; the position in `original`, as what Temml got ends
   * in the same way behind it.
   */
  function explain(error, tex, original) {
    const start = error.position
    if (start === undefined) return { message: error.message, position: null }
    const marks = [` at position ${start + 1}: \n`, ' at end of input: ']
    const found = marks.map((mark) => [error.message.lastIndexOf(mark), mark]).find(([at]) => at >= 0)
    if (found === undefined) return { message: error.message, position: null }
    const [at, mark] = found
    const plain = (text) => text.replaceAll('\u0332', '')
    const excerpt = plain(error.message.slice(at + mark.length))
    const left = plain(start > 15 ? '…' + tex.slice(start - 15, start) : tex.slice(0, start))
    const right = excerpt.slice(left.length).replace(/…$/, '')
    // In a macro that Temml defines, the position is one in that macro's own text.
    const isHere = excerpt.startsWith(left) && plain(tex.slice(start)).startsWith(right)
    const place = start + original.length - tex.length
    const [, name] = /name: (\\@?[A-Za-z]+)/.exec(error.message.replace('\\@', '\\')) ?? []
    const isSymbol = name && name !== original && typeof one({ tex: name, source: name }) === 'string'
    const message = isSymbol ? `Can't use function '${name}' in text mode` : error.message.slice(0, at)
    return { message, position: isHere && original.endsWith(tex.slice(start)) ? place : null }
  }

  function one({ tex, source, display }) {
    if (tex.length > MAX_SOURCE) return { message: `it is longer than ${MAX_SOURCE} characters`, position: null }
    const forbidden = isPlain(tex) ? -1 : tex.search(FORBIDDEN)
    if (forbidden >= 0) return { message: 'it holds a control character', position: forbidden }
    const text = REWRITES.reduce((before, [pattern, replacement]) => before.replace(pattern, replacement), tex)
    try {
      const tree = temml.__renderToMathMLTree(text, { ...OPTIONS, displayMode: display })
      mend(tree, 0)
      tree.children[0].children.at(-1).children[0].text = source // the annotation is what the author wrote
      const markup = tree.toMarkup()
      if (markup.length > MAX_MARKUP) throw new Refusal('it becomes too long')
      return markup
    } catch (error) {
      if (error instanceof temml.ParseError) return explain(error, text, source)
      if (error instanceof Refusal) return { message: error.message, position: null }
      if (error instanceof RangeError && /call stack/.test(error.message)) {
        return { message: 'it is nested too deeply', position: null }
      }
      // Temml's parser takes a part for written that is not there.
      if (error instanceof TypeError) return { message: 'a `_`, a `^` or an accent has no argument', position: null }
      return { message: `it cannot be typeset (${error.message ?? [error].flat().at(-1)})`, position: null } // mhchem throws lists
    }
  }

  return (json) => JSON.stringify(JSON.parse(json).map(one))
})()
