// What every web test needs: the command, the scenes, a place to write, and the way to skip.
import { spawn } from 'node:child_process';
import fs from 'node:fs';
import path from 'node:path';

export const folder = path.resolve(import.meta.dirname, '..');
export const output = path.resolve(process.env.CRANNY_WEB_OUTPUT ?? path.join(folder, '../../build/tests/web'));

export function skip(reason) {
    console.log(`SKIPPED: ${reason}`);
    process.exit(77);
}

export function command() {
    const file = process.env.CRANNY_COMMAND ?? path.resolve(folder, '../../build/cli/cranny');
    if (!fs.existsSync(file))
        skip(`no cranny command at ${file} (CRANNY_COMMAND)`);
    return file;
}

// Extensions that the build under test cannot decode, for want of a library.
export const lacking = (process.env.CRANNY_LACKING ?? '').split(' ').filter(Boolean);

export function isLacking(result) {
    return result.status === 3 && lacking.some((name) => result.stderr.includes(name));
}

export function scenes() {
    const root = process.env.CRANNY_SCENES;
    return root && fs.existsSync(root) ? path.resolve(root) : null;
}

export function needScenes() {
    return scenes() ?? skip('no real scenes (CRANNY_SCENES)');
}

export async function needModule(name) {
    try {
        const module = await import(name);
        return module.default ?? module;
    } catch (error) {
        if (error.code !== 'ERR_MODULE_NOT_FOUND')
            throw error;
        return skip(`npm module ${name} is missing: run "npm ci" in tests/web`);
    }
}

export function filesUnder(root, extensions) {
    return fs.readdirSync(root, { recursive: true, withFileTypes: true })
        .filter((entry) => entry.isFile() && extensions.includes(path.extname(entry.name).toLowerCase()))
        .map((entry) => path.relative(root, path.join(entry.parentPath ?? entry.path, entry.name)))
        .sort();
}

// Run a program to its end; `signal` is set when it was killed, by us after `seconds` or otherwise.
export function execute(file, args, seconds) {
    return new Promise((resolve) => {
        const started = performance.now();
        const child = spawn(file, args, { stdio: ['ignore', 'pipe', 'pipe'] });
        const texts = { stdout: '', stderr: '' };
        for (const name of ['stdout', 'stderr'])
            child[name].on('data', (bytes) => { texts[name] += bytes; });
        let late = false;
        const timer = setTimeout(() => { late = true; child.kill('SIGKILL'); }, seconds * 1000);
        const finish = (status, signal) => {
            clearTimeout(timer);
            resolve({ ...texts, status, signal, late, seconds: (performance.now() - started) / 1000 });
        };
        child.on('error', (error) => { texts.stderr += String(error); finish(null, 'not started'); });
        child.on('close', finish);
    });
}

// `work(item)` for every item, `width` at a time; results in the items' order.
export async function inParallel(items, width, work) {
    const results = new Array(items.length);
    let next = 0;
    const worker = async () => {
        while (next < items.length) {
            const index = next++;
            results[index] = await work(items[index], index);
        }
    };
    await Promise.all(Array.from({ length: width }, worker));
    return results;
}

// Collects failures and ends the program with the verdict. A run without checks fails.
export class Verdict {
    constructor(name) {
        this.name = name;
        this.checks = 0;
        this.failures = 0;
    }
    check(condition, text) {
        this.checks++;
        if (!condition) {
            this.failures++;
            console.log(`FAILED: ${text}`);
        }
        return condition;
    }
    end() {
        console.log(`${this.name}: ${this.checks} checks, ${this.failures} failed`);
        process.exitCode = this.failures || !this.checks ? 1 : 0;
    }
}
