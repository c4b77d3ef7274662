// What the library's types do not know of a page: the kind of a found element is the template's to say.
interface ParentNode {
  querySelector(selectors: string): any
  querySelectorAll(selectors: string): NodeListOf<any>
}
interface Navigator {
  connection?: { saveData?: boolean; effectiveType?: string }
}
interface DocumentEventMap {
  'coursebuild:answered': CustomEvent
  'coursebuild:changed': CustomEvent
  'coursebuild:reading': CustomEvent
}
