// Fits by the module ARGUMENT 1 in memory and compares all results with those of the program: ARGUMENT 2 is its text, ARGUMENT 3 the folder
// of its run, ARGUMENT 4 what it fitted, a model or a record, and each further one a data file by its name in the model.
import { readFileSync } from "node:fs";
import { basename, dirname, join } from "node:path";

const [, , modulePath, textPath, run, input, ...data] = process.argv;
const module = new WebAssembly.Module(readFileSync(modulePath));

// The clocks of the solver libraries ask the browser for its clock through wasm-bindgen: handles of objects are any
// number, and the clock is constant. Every other import is an error.
const answers = [
  [/is_undefined|is_null/, () => 0],
  [/_now_/, () => 0.0],
  [/static_accessor|_performance_|object_clone_ref|externref|is_object|instanceof|globalThis|_self_|_window_/, () => 1],
  [/object_drop_ref|describe/, () => undefined],
];
// The clock of the library, by which it counts.
let reads = 0;
const imports = { host: { seconds: () => ++reads } };
for (const { module: from, name, kind } of WebAssembly.Module.imports(module)) {
  const answer = answers.find(([pattern]) => pattern.test(name));
  imports[from] ??= {};
  imports[from][name] ??= answer?.[1] ?? (() => { throw new Error(`${kind} ${name} was called`); });
}
const { begin, push, analyse, output } = new WebAssembly.Instance(module, imports).exports;

const isModel = input.endsWith(".yaml");
const model = [input.replace(/\.[^.]*$/, ".yaml"), isModel ? readFileSync(input) : ""];
const names = isModel ? data : [basename(input)];
const files = names.flatMap((name) => [name, readFileSync(join(dirname(input), name))]);
for (const part of [...model, ...files]) {
  begin();
  for (const byte of Buffer.from(part)) push(byte);
}
const bytes = Buffer.from(Array.from({ length: analyse() }, (_, i) => output(i)));
const [text, summary, functions, page] = bytes.toString().split("\0");

const read = (path) => readFileSync(path, "utf8").split("\n");
const of = (name) => read(join(run, name));
// The last digits depend on the library of exponentials and the vectors of the Fourier transform.
const number = /-?\d+(\.\d+)?(e[-+]?\d+)?/g;
const agree = (a, b, tolerance) => {
  const [found, wanted] = [a, b].map((line) => (line.match(number) ?? []).map(Number));
  const isClose = (x, i) => Math.abs(x - wanted[i]) <= tolerance * Math.max(1, Math.abs(x));
  return a.replace(number, "") === b.replace(number, "") && found.length === wanted.length && found.every(isClose);
};
const compared = [
  ["model", text, of("model.yaml"), 0],
  // The program names the folder of its results in the last line.
  ["text", summary, read(textPath).filter((line) => !line.startsWith("results in ")), 0],
  // The limits of the axes have all digits.
  ["page", page, of("report.html"), 1e-6],
  ["coefficients", functions, of("functions.csv"), 1e-12],
];
for (const [what, found, wanted, tolerance] of compared) {
  const lines = (found ?? "").split("\n");
  const i = wanted.findIndex((line, i) => line !== lines[i] && !(tolerance > 0 && agree(line, lines[i] ?? "", tolerance)));
  if (i >= 0 || lines.length !== wanted.length) {
    console.log(`${input}: ${what}, line ${i + 1}, in WebAssembly\n${lines[i]}\nby the program\n${wanted[i]}`);
    process.exitCode = 1;
  }
}
if (reads === 0) {
  console.log(`${input}: the clock of the host was not read`);
  process.exitCode = 1;
}
if (process.exitCode !== 1) console.log(`${input}: the same in WebAssembly`);
