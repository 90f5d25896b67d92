// The editor of the code: CodeMirror with Python, and a mark at the line of an error.
import * as cm from "./codemirror.js";
import { value, words } from "./day_words.js";

/** What is offered after a name and a dot, or where a word begins: by the name, what each is. */
const OFFERS = value("offers") ?? {};
const setFault = cm.StateEffect.define();
const marked = cm.Decoration.line({ class: "cm-faulty" }), odd = cm.Decoration.mark({ class: "cm-odd" });

/** The message below the line of an error. */
class Message extends cm.WidgetType {
  constructor(text, hint) {
    super();
    Object.assign(this, { text, hint });
  }

  eq(other) {
    return other.text === this.text && other.hint === this.hint;
  }

  toDOM() {
    const element = document.createElement("div"), hint = document.createElement("div");
    element.className = "cm-fault";
    element.append(this.text, hint);
    hint.textContent = this.hint;
    return element;
  }
}

/** The mark goes with its line, until the line is changed. */
const faults = cm.StateField.define({
  create: () => cm.Decoration.none,
  update(value, transaction) {
    const { state, changes, effects } = transaction;
    if (transaction.docChanged) {
      const touched = [];
      changes.iterChangedRanges((from, to) => touched.push([from, to]));
      const line = value.size && transaction.startState.doc.lineAt(value.iter().from);
      const kept = line && !touched.some(([from, to]) => to >= line.from && from <= line.to);
      value = kept ? value.map(changes) : cm.Decoration.none;
    }
    for (const effect of effects) {
      if (!effect.is(setFault)) continue;
      const fault = effect.value;
      if (!fault || fault.line > state.doc.lines) return cm.Decoration.none;
      const line = state.doc.line(fault.line), widget = new Message(fault.text, fault.hint);
      const sign = fault.place === undefined ? [] : [odd.range(line.from + fault.place, line.from + fault.place + 1)];
      value = cm.Decoration.set([marked.range(line.from), ...sign, cm.Decoration.widget({ widget, block: true, side: 1 }).range(line.to)]);
    }
    return value;
  },
  provide: (field) => cm.EditorView.decorations.from(field),
});

/** What may follow: names of a view, of vrg.agents and of a few others. */
function offers(context) {
  const word = context.matchBefore(/[\w.]*/), dot = word.text.lastIndexOf("."), owner = word.text.slice(0, Math.max(0, dot));
  const found = OFFERS[owner];
  if (!found || (dot < 0 && word.text.length < 2 && !context.explicit)) return null;
  const options = Object.entries(found).map(([label, detail], index) => ({ label, detail, boost: -index }));
  return { from: word.from + dot + 1, options, validFor: /^\w*$/ };
}

const colours = cm.HighlightStyle.define([
  { tag: [cm.tags.keyword, cm.tags.operatorKeyword, cm.tags.controlKeyword, cm.tags.definitionKeyword], color: "#7cc4ff" },
  { tag: [cm.tags.string, cm.tags.special(cm.tags.string)], color: "#a5d6a7" },
  { tag: [cm.tags.number, cm.tags.bool, cm.tags.null], color: "#f5c26b" },
  { tag: cm.tags.comment, color: "#94a0ae", fontStyle: "italic" },
  { tag: [cm.tags.className, cm.tags.definition(cm.tags.className)], color: "#ffd479" },
  { tag: [cm.tags.function(cm.tags.variableName), cm.tags.function(cm.tags.propertyName)], color: "#cdbcff" },
  { tag: cm.tags.self, color: "#ffb3a7" },
]);

const mono = 'ui-monospace, "DejaVu Sans Mono", Menlo, Consolas, monospace';
const theme = cm.EditorView.theme({
  "&": { height: "100%", color: "var(--text)", backgroundColor: "var(--background)", fontSize: "var(--code-size)" },
  "&.cm-focused": { outline: "2px solid var(--caution)", outlineOffset: "-2px" },
  ".cm-scroller": { fontFamily: mono, lineHeight: "1.5", scrollbarWidth: "thin" },
  ".cm-content": { caretColor: "var(--caution)", paddingBottom: "3em" },
  ".cm-cursor": { borderLeft: "2px solid var(--caution)" },
  ".cm-gutters": { backgroundColor: "var(--panel)", color: "var(--muted)", borderRight: "1px solid var(--line)" },
  ".cm-activeLine": { backgroundColor: "#ffffff0c" },
  ".cm-activeLineGutter": { backgroundColor: "#ffffff14", color: "var(--text)" },
  "&.cm-focused > .cm-scroller > .cm-selectionLayer .cm-selectionBackground, .cm-selectionBackground": { background: "#2f5f8f" },
  ".cm-matchingBracket": { backgroundColor: "#3d5a80 !important" },
  ".cm-faulty, .cm-faulty.cm-activeLine": { backgroundColor: "#c4202640", boxShadow: "inset 3px 0 var(--warning)" },
  ".cm-odd": { backgroundColor: "var(--caution)", color: "var(--ink)", outline: "2px solid var(--caution)" },
  ".cm-fault": { padding: ".2em .7em .3em", color: "#ffb3a7", backgroundColor: "#c4202626", fontFamily: "system-ui, sans-serif", boxShadow: "inset 3px 0 var(--warning)", whiteSpace: "pre-wrap" },
  ".cm-fault div": { color: "var(--text)", fontSize: ".93em" },
  ".cm-panels, .cm-tooltip": { backgroundColor: "var(--raised)", color: "var(--text)", border: "1px solid var(--line)" },
  ".cm-tooltip-autocomplete ul li": { padding: ".2em .5em", lineHeight: "1.5" },
  ".cm-tooltip-autocomplete ul li[aria-selected]": { backgroundColor: "var(--calm)", color: "var(--text)" },
  "li[aria-selected] .cm-completionDetail": { color: "var(--text) !important" },
  ".cm-completionDetail": { color: "var(--muted)", fontStyle: "normal" },
  ".cm-textfield, .cm-button": { fontSize: "1em", color: "var(--text)", background: "var(--background)", border: "1px solid var(--line)" },
}, { dark: true });

export class Editor {
  /** Stand within an element. `onChange()` is called when the code has been changed, `onTry()` by CTRL ENTER. */
  constructor(parent, onChange, onTry) {
    // Within a root of its own its styles need no element, which the headers of the page forbid.
    const root = parent.attachShadow({ mode: "open" });
    const go = { key: "Mod-Enter", run: () => (onTry(), true), preventDefault: true };
    this.extensions = [
      cm.Prec.highest(cm.keymap.of([go, { key: "Tab", run: cm.acceptCompletion }])),
      cm.lineNumbers(), cm.highlightSpecialChars(), cm.history(), cm.drawSelection(), cm.indentOnInput(), cm.bracketMatching(), cm.closeBrackets(),
      cm.autocompletion({ icons: false }), cm.highlightActiveLine(), cm.highlightActiveLineGutter(), cm.highlightSelectionMatches(), cm.search({ top: true }),
      cm.keymap.of([...cm.closeBracketsKeymap, ...cm.defaultKeymap, ...cm.searchKeymap, ...cm.historyKeymap, ...cm.completionKeymap, cm.indentWithTab]),
      cm.EditorView.lineWrapping, cm.python(), cm.pythonLanguage.data.of({ autocomplete: offers }), cm.indentUnit.of("    "), cm.EditorState.tabSize.of(4),
      cm.syntaxHighlighting(colours), theme, faults,
      cm.EditorView.contentAttributes.of({ "aria-label": words("student.editor"), autocapitalize: "off", autocorrect: "off" }),
      cm.EditorView.updateListener.of((update) => update.docChanged && !this.loading && onChange()),
    ];
    this.view = new cm.EditorView({ parent: root, root, state: this.stateOf("") });
  }

  stateOf(doc) {
    return cm.EditorState.create({ doc, extensions: this.extensions });
  }

  get code() {
    return this.view.state.doc.toString();
  }

  /** The number of the line with the cursor. */
  get line() {
    const { doc, selection } = this.view.state;
    return doc.lineAt(selection.main.head).number;
  }

  /** Show other code, as it is at first; there is no way back to what stood here. */
  set code(text) {
    this.loading = true;
    this.view.setState(this.stateOf(text));
    this.loading = false;
  }

  /** Put other code in place of what stands here, as if it had been typed: it can be undone. */
  replace(text) {
    const { length } = this.view.state.doc;
    this.view.dispatch({ changes: { from: 0, to: length, insert: text } });
  }

  /** Follow code that was changed elsewhere; the cursor stays where it can. */
  follow(text) {
    const { head } = this.view.state.selection.main;
    this.loading = true;
    this.replace(text);
    this.view.dispatch({ selection: { anchor: Math.min(head, text.length) } });
    this.loading = false;
  }

  /** The text of a line, from 1; empty if there is none. */
  textOf(number) {
    const { doc } = this.view.state;
    return number >= 1 && number <= doc.lines ? doc.line(number).text : "";
  }

  /** Mark the line of an error {line, text, hint, place}, the place of a sign where one is known; null takes the mark away. */
  mark(fault) {
    this.view.dispatch({ effects: setFault.of(fault) });
  }

  /** Put the cursor to a line, and show it. */
  goTo(number) {
    const line = this.view.state.doc.line(Math.min(number, this.view.state.doc.lines));
    this.view.dispatch({ selection: { anchor: line.to }, effects: cm.EditorView.scrollIntoView(line.from, { y: "center" }) });
    this.view.focus();
  }

  /** Put a text where the cursor is. */
  insert(text) {
    this.view.dispatch(this.view.state.replaceSelection(text), { scrollIntoView: true, userEvent: "input.type" });
  }

  /** Do what a key does that telephones lack: "indent", "outdent", "undo", or a sign. */
  press(key) {
    const command = { indent: cm.indentMore, outdent: cm.indentLess, undo: cm.undo }[key];
    if (command) command(this.view);
    else this.insert(key);
    this.view.focus();
  }
}
