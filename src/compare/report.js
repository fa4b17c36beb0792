'use strict';
const fullScale = 0.25 * 255; // of the error map, as cranny diff's
const root = document.body;
const bar = document.querySelector('.bar');
const state = { mode: 'split', magnify: 8, linked: false, view: null };
const views = [...document.querySelectorAll('.view')].map(prepareView);

function prepareView(section) {
    const picture = section.querySelector('.truth .test');
    const view = { section, picture, x: 0.5, y: 0.5 };
    const url = blobUrl(picture.src);
    view.tiles = [...section.querySelectorAll('.tile')].map((figure) => prepareTile(view, figure, url));
    section.querySelector('.tiles').addEventListener('pointerleave', () => look(null));
    return view;
}

// One copy of the truth for all that show it.
function blobUrl(dataUrl) {
    const bytes = Uint8Array.from(atob(dataUrl.slice(dataUrl.indexOf(',') + 1)), (c) => c.charCodeAt(0));
    return URL.createObjectURL(new Blob([bytes], { type: 'image/png' }));
}

function prepareTile(view, figure, truthUrl) {
    const find = (selector) => figure.querySelector(selector);
    const tile = { figure, split: find('.split'), test: find('.test'), over: find('.over'), map: find('.map'), lens: find('.lens'), here: find('output'), slider: find('input') };
    tile.isTruth = figure.classList.contains('truth');
    if (tile.over)
        tile.over.src = truthUrl;
    tile.slider.addEventListener('input', () => moveSplits(view, tile));
    tile.slider.addEventListener('keydown', (event) => onKey(event, view, tile));
    tile.slider.addEventListener('focus', () => { if (tile.slider.matches(':focus-visible')) look(view); });
    tile.slider.addEventListener('blur', () => look(null));
    for (const name of ['pointermove', 'pointerdown'])
        tile.split.addEventListener(name, (event) => onPointer(event, view, tile));
    find('button')?.addEventListener('click', (event) => copy(event.target, find('code')));
    return tile;
}

function setSplit(tile, value) {
    tile.slider.value = value;
    tile.split.style.setProperty('--at', `${tile.slider.value}%`);
}

function moveSplits(view, tile) {
    for (const other of state.linked ? view.tiles : [tile])
        setSplit(other, tile.slider.value);
}

function onPointer(event, view, tile) {
    const box = tile.split.getBoundingClientRect();
    view.x = clamp((event.clientX - box.left) / box.width);
    view.y = clamp((event.clientY - box.top) / box.height);
    look(view);
}

const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

function onKey(event, view, tile) {
    const arrow = arrows[event.key];
    const step = { '+': 2, '=': 2, '-': 0.5 }[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey)
        return;
    if (arrow && (event.shiftKey || arrow[1] || state.mode !== 'split' || tile.isTruth)) {
        view.x = clamp(view.x + arrow[0] * 0.02);
        view.y = clamp(view.y + arrow[1] * 0.02);
        look(view);
    } else if (step) {
        setMagnify(state.magnify * step);
    } else if (event.key === 'Escape') {
        look(null);
    } else {
        return;
    }
    event.preventDefault();
}

function clamp(share) {
    return Math.min(Math.max(share, 0), 1);
}

// The place under the pointer, or that the keys moved to, in every tile of the view.
function look(view) {
    if (state.view && state.view !== view)
        state.view.section.classList.remove('looking');
    state.view = view;
    if (!view || !state.magnify)
        return;
    view.section.classList.add('looking');
    for (const tile of view.tiles)
        drawLens(view, tile);
}

function pixels(image, x, y, width, height) {
    const canvas = pixels.canvas ??= document.createElement('canvas');
    canvas.width = width;
    canvas.height = height;
    const context = canvas.getContext('2d', { willReadFrequently: true });
    context.drawImage(image, -x, -y);
    return context.getImageData(0, 0, width, height);
}

// Signed, in place: white where equal, blue where too dark, red where too bright.
function toMap(test, truth) {
    for (let i = 0; i < test.data.length; i += 4) {
        const difference = test.data[i] - truth.data[i];
        const rest = Math.round(255 * (1 - Math.min(Math.abs(difference) / fullScale, 1)));
        test.data[i] = difference < 0 ? rest : 255;
        test.data[i + 1] = rest;
        test.data[i + 2] = difference > 0 ? rest : 255;
    }
    return test;
}

function drawLens(view, tile) {
    const image = tile.test;
    tile.split.style.setProperty('--x', `${100 * view.x}%`);
    tile.split.style.setProperty('--y', `${100 * view.y}%`);
    tile.split.classList.toggle('east', view.x > 0.5);
    if (!image.complete || !image.naturalWidth)
        return;
    const side = Math.max(3, Math.round(tile.lens.clientWidth / state.magnify)) | 1;
    const x = Math.min(Math.floor(view.x * image.naturalWidth), image.naturalWidth - 1);
    const y = Math.min(Math.floor(view.y * image.naturalHeight), image.naturalHeight - 1);
    const half = side >> 1;
    const test = pixels(image, x - half, y - half, side, side);
    const truth = pixels(view.picture, x - half, y - half, side, side);
    const middle = 4 * (half * side + half);
    describe(tile, test.data[middle] / 255, truth.data[middle] / 255);
    tile.lens.width = tile.lens.height = side;
    tile.lens.getContext('2d').putImageData(state.mode === 'error' && !tile.isTruth ? toMap(test, truth) : test, 0, 0);
}

function describe(tile, test, truth) {
    const difference = test - truth;
    const sign = difference < 0 ? '\u2212' : '+';
    tile.here.textContent = tile.isTruth ? truth.toFixed(2) : `${test.toFixed(2)} (${sign}${Math.abs(difference).toFixed(2)})`;
}

async function drawMap(view, tile) {
    if (tile.mapped || tile.isTruth)
        return;
    tile.mapped = true;
    await Promise.all([tile.test.decode(), view.picture.decode()]);
    const { naturalWidth: width, naturalHeight: height } = tile.test;
    tile.map.width = width;
    tile.map.height = height;
    const map = toMap(pixels(tile.test, 0, 0, width, height), pixels(view.picture, 0, 0, width, height));
    tile.map.getContext('2d').putImageData(map, 0, 0);
}

const seen = new IntersectionObserver((entries) => {
    for (const entry of entries)
        if (entry.isIntersecting)
            for (const view of views)
                for (const tile of view.tiles)
                    if (tile.split === entry.target && state.mode === 'error')
                        drawMap(view, tile);
}, { rootMargin: '50%' });

function watchTiles() {
    for (const view of views)
        for (const tile of view.tiles) {
            seen.unobserve(tile.split);
            seen.observe(tile.split);
        }
}

function setMode(mode) {
    state.mode = mode;
    root.dataset.mode = mode;
    watchTiles();
    look(state.view);
}

function setMagnify(value) {
    const choice = [...bar.querySelectorAll('[name=magnify] option')].find((option) => Number(option.value) === value);
    if (!choice)
        return;
    choice.selected = true;
    state.magnify = value;
    const view = state.view;
    look(null);
    look(view);
}

async function copy(button, code) {
    try {
        await navigator.clipboard.writeText(code.textContent);
        button.textContent = 'copied';
    } catch {
        getSelection().selectAllChildren(code);
        button.textContent = 'selected';
    }
    setTimeout(() => { button.textContent = 'copy'; }, 1500);
}

bar.hidden = false;
bar.addEventListener('change', (event) => {
    if (event.target.name === 'mode')
        setMode(event.target.value);
    else if (event.target.name === 'magnify')
        setMagnify(Number(event.target.value));
    else
        state.linked = event.target.checked;
});
addEventListener('beforeprint', () => views.forEach((view) => view.tiles.forEach((tile) => drawMap(view, tile))));
setMode(bar.querySelector('[name=mode]:checked').value);
setMagnify(Number(bar.querySelector('[name=magnify]').value));
document.documentElement.dataset.ready = '';
