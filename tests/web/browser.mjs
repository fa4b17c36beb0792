// Baked scenes in three.js, in headless Chromium: under ambient light each pixel is dimmed by the
// visibility that the file holds there, occluded places are darker than open ones; under direct
// light alone nothing changes. The pictures go to CRANNY_WEB_OUTPUT for people to look at.
import fs from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import { Verdict, command, execute, folder, isLacking, needModule, output, scenes, skip } from './lib/setup.mjs';
import { courtGlb } from './lib/court.mjs';

const cranny = command();
const { chromium } = await needModule('playwright-core');
await needModule('three');
const executablePath = process.env.CRANNY_CHROMIUM ?? ['chromium', 'chromium-browser', 'google-chrome']
    .map((name) => path.join('/usr/bin', name)).find((file) => fs.existsSync(file));
if (!executablePath || !fs.existsSync(executablePath))
    skip('no Chromium in /usr/bin (CRANNY_CHROMIUM)');

const size = { width: 800, height: 450 };
const flags = ['--headless=new', '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader',
    '--enable-unsafe-swiftshader', '--disable-background-networking', '--disable-component-update',
    '--disable-default-apps', '--disable-sync', '--no-first-run', '--disable-dev-shm-usage'];

// `loose`: fewer rays; `replace`: the scene's own occlusion textures are displaced.
// `points`: an occluded and an open place on the same kind of surface.
const shows = [
    { name: 'court', view: { eye: [5, 4, 7], at: [0, 0.7, 0], near: 0.1, far: 50 }, points: [[0, 0, 1.03], [3, 0, 3]] },
    { name: 'sponza', file: 'crytek_sponza/crytek_sponza.glb', view: { eye: [10, 2, 0], at: [0, 3, 0], near: 0.1, far: 100, fov: 60 } },
    { name: 'dragon', file: 'stanford_dragon/stanford_dragon_res2.glb' },
    { name: 'room', file: 'godot_room/room.glb', loose: true },
    { name: 'chess-draco', file: 'chess_board_draco/chess-board.glb', loose: true, replace: true },
    { name: 'garden-meshopt', file: 'japanese_bridge_garden_meshopt/scene.glb', loose: true },
];

function serve(files) {
    const types = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };
    const find = (url) => {
        if (files.has(url))
            return files.get(url);
        const file = path.join(folder, url);
        const open = ['/page.html', '/page.js'].includes(url) || url.startsWith('/node_modules/three/');
        return open && file.startsWith(folder + path.sep) ? file : null;
    };
    const server = http.createServer((request, response) => {
        const file = find(path.posix.normalize(new URL(request.url, 'http://local').pathname));
        if (!file || !fs.existsSync(file)) {
            response.writeHead(404).end();
            return;
        }
        response.writeHead(200, { 'content-type': types[path.extname(file)] ?? 'application/octet-stream' });
        fs.createReadStream(file).pipe(response);
    });
    return new Promise((resolve) => server.listen(0, '127.0.0.1', () => resolve(server)));
}

async function prepare(verdict) {
    const court = path.join(output, 'court.glb');
    fs.writeFileSync(court, courtGlb());
    const ready = [];
    for (const show of shows) {
        const before = show.file ? scenes() && path.join(scenes(), show.file) : court;
        if (!before || !fs.existsSync(before)) {
            console.log(`${show.name}: SKIPPED: no ${show.file} (CRANNY_SCENES)`);
            continue;
        }
        const after = path.join(output, `${show.name}-ao.glb`);
        const args = ['bake', before, '-o', after, '--quiet', ...(show.loose ? ['--rays', '16'] : []),
            ...(show.replace ? ['--replace'] : [])];
        const result = await execute(cranny, args, 300);
        if (isLacking(result)) {
            console.log(`${show.name}: SKIPPED: ${result.stderr.trim()}`);
            continue;
        }
        if (verdict.check(result.status === 0, `${show.name}: bake: ${result.signal ?? result.status} ${result.stderr}`))
            ready.push({ ...show, before, after });
    }
    return ready;
}

function judge(verdict, show, m) {
    const check = (condition, text) => verdict.check(condition, `${show.name}: ${text}`);
    check(m.covered > 0.05, `only ${m.pixels} pixels to compare`);
    check(m.correlation > 0.99, `ratio and visibility correlate by ${m.correlation} only`);
    check(m.meanError < 0.005, `ratio and visibility differ by ${m.meanError} on average`);
    check(m.error999 < 0.05, `ratio and visibility differ by ${m.error999} in 1 of 1000 pixels`);
    check(m.bright <= 1.005, `something became brighter: ${m.bright}`);
    check(m.mean < 0.97, `ambient light is dimmed to ${m.mean} only`);
    check(m.dark < 0.75 * m.bright, `occluded places (${m.dark}) are hardly darker than open ones (${m.bright})`);
    if (m.openPixels > 100)
        check(Math.abs(m.open - 1) < 0.02, `open places are dimmed to ${m.open}`);
    check(m.lit > 0.02 * size.width * size.height, `direct light reaches ${m.lit} pixels only`);
    check(m.sun <= 1 / 255, `direct light alone changed by ${m.sun}`);
    if (show.points)
        check(m.at[0] < 0.8 * m.at[1], `the occluded place has ${m.at[0]}, the open one ${m.at[1]}`);
}

fs.mkdirSync(output, { recursive: true });
const verdict = new Verdict('browser');
const ready = await prepare(verdict);
const files = new Map(ready.flatMap((show) => [[`/before/${show.name}.glb`, show.before], [`/after/${show.name}.glb`, show.after]]));
const server = await serve(files);
const browser = await chromium.launch({ executablePath, args: flags, ignoreDefaultArgs: ['--disable-gpu'] });
try {
    const page = await browser.newPage();
    page.on('console', (message) => { if (message.type() === 'error') console.log(`page: ${message.text()}`); });
    page.on('pageerror', (error) => verdict.check(false, `page: ${error}`));
    await page.goto(`http://127.0.0.1:${server.address().port}/page.html`);
    await page.waitForFunction(() => window.measure);
    for (const { name, view, points, replace = false, ...show } of ready) {
        const measured = await page.evaluate((job) => window.measure(job),
            { before: `/before/${name}.glb`, after: `/after/${name}.glb`, view, points, size, replace });
        for (const [kind, url] of Object.entries(measured.pictures))
            fs.writeFileSync(path.join(output, `${name}-${kind}.png`), Buffer.from(url.split(',')[1], 'base64'));
        delete measured.pictures;
        console.log(name, JSON.stringify(measured, (key, value) => typeof value === 'number' ? Number(value.toPrecision(4)) : value));
        judge(verdict, { name, points, ...show }, measured);
    }
} finally {
    await browser.close();
    server.close();
}
verdict.check(ready.length > 0, 'nothing was shown');
verdict.end();
