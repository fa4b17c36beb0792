// Bakes every scene under CRANNY_SCENES with small settings, for validate.mjs and lossless.mjs:
// the files and results.json go to CRANNY_WEB_OUTPUT/baked. Here it is only checked that each run
// ends in time, with status 0 and a file, or with 3, one line on stderr and no file; and that
// nothing in the scenes' folder was touched.
import fs from 'node:fs';
import path from 'node:path';
import { Verdict, command, execute, filesUnder, inParallel, needScenes, output } from './lib/setup.mjs';

const cranny = command();
const root = needScenes();
const folder = path.join(output, 'baked');
const modes = ['occlusion', 'color', 'attribute'];
const secondsAllowed = 60; // sanitizer builds are slow
const largeBytes = 1 << 20; // beyond this only the default mode is run

function snapshot() {
    return fs.readdirSync(root, { recursive: true }).sort().map((name) => {
        const info = fs.statSync(path.join(root, name));
        return `${name} ${info.size} ${info.mtimeMs}`;
    }).join('\n');
}

function runsFor(file) {
    const isGltf = ['.glb', '.gltf'].includes(path.extname(file).toLowerCase());
    const large = fs.statSync(path.join(root, file)).size > largeBytes;
    return modes.slice(0, large || !isGltf ? 1 : modes.length).map((mode) => ({
        file, mode, imported: !isGltf,
        baked: path.join(mode, isGltf ? file : `${file}.glb`),
    }));
}

async function bake(run) {
    const target = path.join(folder, run.baked);
    fs.mkdirSync(path.dirname(target), { recursive: true });
    const args = ['bake', path.join(root, run.file), '-o', target, '--quiet', '--rays', '8', '--to', run.mode];
    const result = await execute(cranny, args, secondsAllowed);
    return { ...run, ...result, written: fs.existsSync(target) };
}

function judge(verdict, run) {
    const name = `${run.file} (--to ${run.mode})`;
    const ended = run.late ? `no end after ${secondsAllowed} s` : run.signal ?? `status ${run.status}`;
    if (!verdict.check(run.status === 0 || run.status === 3, `${name}: ${ended}: ${run.stderr.trim()}`))
        return;
    verdict.check(run.written === (run.status === 0), `${name}: status ${run.status}, file ${run.written}`);
    if (run.status === 0)
        return;
    const lines = run.stderr.split('\n').filter(Boolean);
    verdict.check(lines.length === 1 && run.stderr.endsWith('\n'), `${name}: ${lines.length} lines on stderr: ${run.stderr}`);
    verdict.check(run.stderr.includes(path.basename(run.file)), `${name}: the line does not name the file: ${run.stderr}`);
}

// Beside the outputs may stand what they refer to, copied, and nothing else.
function checkOthers(verdict) {
    const outputs = new Set(results.map((run) => run.baked));
    for (const entry of fs.readdirSync(folder, { recursive: true, withFileTypes: true })) {
        const name = path.relative(folder, path.join(entry.parentPath ?? entry.path, entry.name));
        if (!entry.isFile() || outputs.has(name))
            continue;
        const original = path.join(root, name.slice(name.indexOf(path.sep) + 1));
        const same = fs.existsSync(original) && fs.readFileSync(original).equals(fs.readFileSync(path.join(folder, name)));
        verdict.check(same, `${name} was left, and is no copy of a file of the scene`);
    }
}

fs.rmSync(folder, { recursive: true, force: true });
fs.mkdirSync(folder, { recursive: true });
const before = snapshot();
const runs = filesUnder(root, ['.glb', '.gltf', '.obj']).flatMap(runsFor);
const results = await inParallel(runs, 2, bake);
const verdict = new Verdict('bake');
for (const run of results)
    judge(verdict, run);
verdict.check(snapshot() === before, `something under ${root} changed`);
checkOthers(verdict);
fs.writeFileSync(path.join(folder, 'results.json'), JSON.stringify({ root, runs: results }, null, 1));
const slowest = [...results].sort((a, b) => b.seconds - a.seconds).slice(0, 5);
console.log(`${runs.length} runs: ${results.filter((run) => run.status === 0).length} baked, ${results.filter((run) => run.status === 3).length} refused`);
for (const run of slowest)
    console.log(`${run.seconds.toFixed(2)} s  ${run.file} (--to ${run.mode})`);
verdict.end();
