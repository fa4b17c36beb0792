// The page of cranny compare, opened from its file in headless Chromium: no console error, no
// request beyond what it holds, splits, error maps and the lens by mouse and keyboard, labels of
// the plot apart, no sideways scrolling on a phone, light, dark and print. Screenshots go to
// CRANNY_WEB_OUTPUT/compare for people to look at.
import fs from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';
import { Verdict, command, execute, needModule, output, scenes, skip } from './lib/setup.mjs';
import { courtGlb } from './lib/court.mjs';

const cranny = command();
const { chromium } = await needModule('playwright-core');
const executablePath = process.env.CRANNY_CHROMIUM ?? ['chromium', 'chromium-browser', 'google-chrome']
    .map((name) => path.join('/usr/bin', name)).find((file) => fs.existsSync(file));
if (!executablePath || !fs.existsSync(executablePath))
    skip('no Chromium in /usr/bin (CRANNY_CHROMIUM)');

const folder = path.join(output, 'compare');
const flags = ['--headless=new', '--no-sandbox', '--disable-gpu', '--disable-background-networking',
    '--disable-component-update', '--disable-default-apps', '--disable-sync', '--no-first-run', '--disable-dev-shm-usage'];
const wide = { width: 1280, height: 900 }, phone = { width: 360, height: 740 };

// bench/views.c's, one of each scene.
const real = [['crytek_sponza/crytek_sponza.glb', 'nave=10,2,0:0,3,0:60', '1'],
    ['stanford_dragon/stanford_dragon_res3.glb', 'front=0.05,0.18,0.36:0,0.12,0:32', '0.03'],
    ['contemporary_bathroom/contemporary_bathroom.glb', 'basin=1.2,1.5,-1:-1.5,0.7,-2:60', '0.4'],
    ['level_pandora/pandora.glb', 'hall=20,9,0:-10,9,2:70', '1.5'],
    ['godot_room/room.glb', 'corner=3.5,2.6,3.5:-2,0.8,-2:65', '0.5'],
    ['japanese_bridge_garden_meshopt/scene.glb', 'bridge=8,5,7:0,2.2,0:45', '0.6']]
    .filter(([file]) => scenes() && fs.existsSync(path.join(scenes(), file)));

// The command line that shows what is there: a court with a hostile name, and real scenes.
function compareArguments() {
    const court = path.join(folder, 'court <img src=x onerror=alert(1)> "&amp;.glb');
    fs.writeFileSync(court, courtGlb());
    const args = ['compare', court, '--view', 'front=5,4,7:0,0.7,0:45', '--view', '<i>back</i>=3,2,-6:0,0.7,0:60'];
    for (const [file, view, radius] of real)
        args.push(path.join(scenes(), file), '--view', view, '--radius', radius);
    const preset = path.join(folder, 'soft & <b>.json');
    fs.writeFileSync(preset, '{"method": "volumes", "intensity": 0.8}');
    return [...args, '--preset', preset, '-o', path.join(folder, 'out'), '--size', '320x180', '--rays', '32', '--repeat', '1', '--json'];
}

function watch(page, verdict, name) {
    page.on('console', (message) => verdict.check(message.type() !== 'error', `${name}: console: ${message.text()}`));
    page.on('pageerror', (error) => verdict.check(false, `${name}: ${error}`));
    page.on('dialog', (dialog) => { verdict.check(false, `${name}: a dialog: ${dialog.message()}`); dialog.dismiss(); });
    page.on('request', (request) => {
        const url = request.url();
        verdict.check(url === address || /^(data|blob):/.test(url), `${name}: requested ${url.slice(0, 200)}`);
    });
}

async function open(browser, verdict, name, options) {
    const page = await browser.newPage(options);
    watch(page, verdict, name);
    await page.goto(address);
    await page.waitForSelector('html[data-ready]');
    return page;
}

async function checkContent(page, verdict, results) {
    const found = await page.evaluate(() => ({
        views: document.querySelectorAll('.view').length,
        tiles: document.querySelectorAll('.tile:not(.truth)').length,
        rows: document.querySelectorAll('tbody tr').length,
        commands: [...document.querySelectorAll('.tile code')].map((code) => code.textContent),
        hostile: document.querySelectorAll('main [onerror]').length,
        broken: [...document.images].filter((image) => image.complete && !image.naturalWidth).length,
        unnamed: [...document.querySelectorAll('input, select, [tabindex]')].filter((element) =>
            element.tagName !== 'CODE' && !element.ariaLabel && !element.labels?.length).length,
    }));
    const expected = results.views.flatMap((view) => [view.reference.command, ...view.methods.map((trial) => trial.command)]);
    verdict.check(found.views === results.views.length, `${found.views} views`);
    verdict.check(found.tiles === results.views.reduce((sum, view) => sum + view.methods.length, 0), `${found.tiles} tiles`);
    verdict.check(found.rows === results.views[0].methods.length + 1, `${found.rows} rows`);
    verdict.check(JSON.stringify(found.commands) === JSON.stringify(expected), `commands: ${found.commands[0]}`);
    verdict.check(found.hostile === 0 && found.broken === 0 && found.unnamed === 0, JSON.stringify({ ...found, commands: 0 }));
}

// Labels of a plot do not cover one another, and stay in the picture.
async function checkPlots(page, verdict) {
    const plots = await page.evaluate(() => [...document.querySelectorAll('.plot svg')].map((svg) => {
        const boxes = [...svg.querySelectorAll('.label')].map((label) => label.getBBox());
        const covers = (a, b) => a.x < b.x + b.width && b.x < a.x + a.width && a.y + 3 < b.y + b.height && b.y + 3 < a.y + a.height;
        const view = svg.viewBox.baseVal;
        return {
            labels: boxes.length, front: svg.querySelectorAll('.front').length,
            covered: boxes.flatMap((a, i) => boxes.slice(i + 1).filter((b) => covers(a, b))).length,
            outside: boxes.filter((box) => box.x < 0 || box.x + box.width > view.width || box.y < 0 || box.y + box.height > view.height).length,
        };
    }));
    for (const plot of plots)
        verdict.check(plot.labels > 0 && plot.front === 1 && plot.outside === 0 && plot.covered <= 1, `plot: ${JSON.stringify(plot)}`);
}

const at = (split) => split.evaluate((element) => element.style.getPropertyValue('--at'));
const isLooking = (page, view) => page.evaluate((number) => document.querySelectorAll('.view')[number].classList.contains('looking'), view);
const lenses = (splits) => splits.evaluateAll((all) => all.map((split) => split.querySelector('.lens').toDataURL()).join());

async function checkSplits(page, verdict, number) {
    const splits = page.locator('.view').nth(number).locator('.tile:not(.truth) .split');
    const slider = splits.nth(0).locator('input');
    await slider.focus();
    for (let i = 0; i < 5; i++)
        await page.keyboard.press('ArrowRight');
    verdict.check(await at(splits.nth(0)) === '55%', `split by keys: ${await at(splits.nth(0))}`);
    verdict.check(await at(splits.nth(1)) !== '55%', 'the other split moved, too');
    await splits.nth(1).evaluate((split) => split.scrollIntoView({ block: 'center' }));
    const box = await splits.nth(1).boundingBox();
    await page.mouse.move(box.x + 0.5 * box.width, box.y + 20);
    await page.mouse.down();
    await page.mouse.move(box.x + 0.25 * box.width, box.y + 20, { steps: 4 });
    await page.mouse.up();
    const dragged = parseFloat(await at(splits.nth(1)));
    verdict.check(Math.abs(dragged - 25) < 4, `split by drag: ${dragged}`);
    await page.check('[name=linked]');
    await slider.focus();
    await page.keyboard.press('Home');
    verdict.check(await at(splits.nth(3)) === '0%', 'linked splits do not move together');
    await page.uncheck('[name=linked]');
}

async function checkLens(page, verdict, number) {
    const view = page.locator('.view').nth(number), splits = view.locator('.tile:not(.truth) .split');
    await page.mouse.move(0, 0);
    await splits.nth(0).evaluate((split) => split.scrollIntoView({ block: 'center' }));
    const box = await splits.nth(0).boundingBox();
    await page.mouse.move(box.x + 0.3 * box.width, box.y + 0.6 * box.height);
    verdict.check(await isLooking(page, number), 'no lens under the pointer');
    const places = await splits.evaluateAll((all) => all.map((split) => split.style.getPropertyValue('--x')));
    verdict.check(new Set(places).size === 1 && Math.abs(parseFloat(places[0]) - 30) < 1, `places: ${places}`);
    const shown = await splits.evaluateAll((all) => all.map((split) => split.querySelector('output').textContent));
    verdict.check(shown.every((text) => /^[01]\.\d\d \([+−]\d\.\d\d\)$/.test(text)), `read out: ${shown}`);
    const before = await lenses(splits);
    await splits.nth(0).locator('input').focus();
    await page.keyboard.press('Shift+ArrowRight');
    await page.keyboard.press('ArrowUp');
    for (let i = 0; i < 6; i++)
        await page.keyboard.press('ArrowDown');
    const moved = await splits.nth(2).evaluate((split) => ['--x', '--y'].map((name) => parseFloat(split.style.getPropertyValue(name))));
    verdict.check(Math.abs(moved[0] - 32) < 1 && Math.abs(moved[1] - 70) < 2, `the place went to ${moved}`);
    verdict.check(await lenses(splits) !== before, 'the lenses show the same after a move');
    await page.keyboard.press('+');
    verdict.check(await page.inputValue('[name=magnify]') === '16', 'the key + does not magnify');
    await page.keyboard.press('-');
    verdict.check(await page.inputValue('[name=magnify]') === '8', 'the key - does not magnify less');
    await page.keyboard.press('Escape');
    verdict.check(!await isLooking(page, number), 'Escape does not close the lens');
}

// The map drawn in the page is the one in the folder.
async function checkMap(page, verdict, results) {
    await page.check('[value=error]');
    const tile = page.locator('.view').nth(0).locator('.tile').nth(4);
    await tile.scrollIntoViewIfNeeded();
    const map = tile.locator('canvas.map');
    await page.waitForFunction((canvas) => canvas.width > 1, await map.elementHandle());
    const file = fs.readFileSync(path.join(folder, 'out', results.views[0].methods[3].error_map));
    const differing = await map.evaluate(async (canvas, url) => {
        const image = new Image();
        image.src = url;
        await image.decode();
        const other = document.createElement('canvas');
        other.width = canvas.width;
        other.height = canvas.height;
        other.getContext('2d').drawImage(image, 0, 0);
        const data = (source) => source.getContext('2d').getImageData(0, 0, source.width, source.height).data;
        const a = data(canvas), b = data(other);
        return a.reduce((worst, value, i) => Math.max(worst, Math.abs(value - b[i])), 0);
    }, `data:image/png;base64,${file.toString('base64')}`);
    verdict.check(differing <= 5, `the page's map differs from the file's by ${differing}`);
    await page.screenshot({ path: path.join(folder, 'error.png') });
    await page.check('[value=split]');
}

async function checkLooks(browser, verdict) {
    for (const [name, options] of Object.entries({ light: { viewport: wide, colorScheme: 'light' }, dark: { viewport: wide, colorScheme: 'dark' },
        phone: { viewport: phone, colorScheme: 'light', hasTouch: true }, bare: { viewport: wide, javaScriptEnabled: false } })) {
        const page = await browser.newPage(options);
        watch(page, verdict, name);
        await page.goto(address);
        await page.screenshot({ path: path.join(folder, `${name}.png`) });
        if (name !== 'bare') {
            const spare = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
            verdict.check(spare <= 0, `${name}: ${spare} pixels too wide`);
            await page.locator('.tiles').first().evaluate((tiles) => tiles.scrollIntoView());
            await page.screenshot({ path: path.join(folder, `${name}-tiles.png`) });
            for (let view = 0; view < real.length; view++) {
                await page.locator('.view').nth(2 + view).evaluate((section) => section.scrollIntoView());
                await page.screenshot({ path: path.join(folder, `${name}-${path.basename(path.dirname(real[view][0]))}.png`) });
            }
        }
        if (name === 'light')
            await page.pdf({ path: path.join(folder, 'print.pdf'), format: 'A4' });
        await page.close();
    }
}

fs.rmSync(folder, { recursive: true, force: true });
fs.mkdirSync(folder, { recursive: true });
const verdict = new Verdict('compare');
const address = pathToFileURL(path.join(folder, 'out/index.html')).href;
const made = await execute(cranny, compareArguments(), 300);
if (verdict.check(made.status === 0, `compare: ${made.signal ?? made.status} ${made.stderr}`)) {
    const results = JSON.parse(made.stdout);
    const browser = await chromium.launch({ executablePath, args: flags });
    try {
        const page = await open(browser, verdict, 'page', { viewport: wide });
        await checkContent(page, verdict, results);
        await checkPlots(page, verdict);
        for (let view = 0; view < results.views.length; view++) {
            await checkSplits(page, verdict, view);
            await checkLens(page, verdict, view);
        }
        await checkMap(page, verdict, results);
        await page.close();
        await checkLooks(browser, verdict);
    } finally {
        await browser.close();
    }
}
verdict.end();
