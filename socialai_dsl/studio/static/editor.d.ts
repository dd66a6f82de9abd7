/** What studio.js uses of the bundle `editor.js`, which is made from editor/editor.js by `npm run bundle`. */
export type Verdict = { line: number; text: string; kind: "good" | "bad" | "open" };
export class Editor {
  constructor(parent: HTMLElement, options: {
    root: string; language: string; nonce: string; wraps: boolean; changed: (text: string) => void; save: () => void;
  });
  readonly text: string;
  open(name: string, text: string): void;
  replace(text: string): void;
  goTo(line: number, column?: number): void;
  wrap(wraps: boolean): void;
  judge(found: Verdict[]): void;
}
