'use strict';
// The page holds nothing but what it shows: whatever is moved to is asked of the server.
const $ = (id) => document.getElementById(id);
const SPANS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60, 300, 900];
const wanted = {stop: null, span: 10, points: 1500};
let socket = null, last = null, playing = null, asked = '', log = [];
const course = {start: 0, stop: 1};

// What is measured is drawn last, so that no band hides it.
const shown = () => [last.start, last.stop];
// What moves need be no metres: in which units mm, um and kN are said is told by the server.
let units = {mm: 'mm', um: 'um', kN: 'kN'};
const mm = (v) => v == null ? '-' : `${v.toFixed(4)} ${units.mm}`;
const um = (v) => v == null ? '-' : `${v.toFixed(1)} ${units.um}`;
const edge = stroke(COLOR.edge, 0.6), median = stroke(COLOR.edge, 0.8, [2, 3]);
const BAND = {label: 'band', color: COLOR.band, series: [1, 3]};
const panels = {
  motion: [['lower', 'median', 'upper', 'command', 'measured'], new Panel($('samples'), {
    title: () => `displacement [${units.mm}]`, axis: true, x: shown, sync: 'samples',
    keys: [BAND, {label: 'its median', color: COLOR.edge, line: true, dash: true, series: [2]},
      {label: 'command', color: COLOR.command, line: true, dash: true, series: [4]},
      {label: 'measured', color: COLOR.measured, line: true, series: [5]}],
    series: [edge, median, edge, stroke(COLOR.command, 0.8, [4, 3]), stroke(COLOR.measured, 1.4)],
    bands: [{series: [3, 1], fill: COLOR.band}],
    readout: (u, i) => `${u.data[0][i].toFixed(3)} s: ${mm(u.data[5][i])}, command ${mm(u.data[4][i])}`,
  })],
  residual: [['residual_lower', 'residual_upper', 'residual'], new Panel($('samples'), {
    title: () => `residual [${units.um}]`, x: shown, sync: 'samples',
    keys: [{...BAND, series: [1, 2]},
      {label: 'measured less the median', color: COLOR.measured, line: true, series: [3]}],
    series: [edge, edge, stroke(COLOR.measured, 1)], bands: [{series: [2, 1], fill: COLOR.band}],
    readout: (u, i) => u.data[3][i] == null ? '' :
      `${um(u.data[3][i])}, band ${um(u.data[1][i])} to ${um(u.data[2][i])}`,
  })],
  error: [['error'], new Panel($('samples'), {
    title: () => `tracking error [${units.mm}]`, x: shown, sync: 'samples',
    keys: [{label: 'command less measured', color: COLOR.command, line: true, series: [1]}],
    series: [stroke(COLOR.command, 1.2)], readout: (u, i) => mm(u.data[1][i]),
  })],
  force: [['force'], new Panel($('samples'), {
    title: () => `force [${units.kN}]`, x: shown, sync: 'samples',
    keys: [{label: 'measured', color: COLOR.force, line: true, series: [1]}],
    series: [stroke(COLOR.force, 1.2)],
    readout: (u, i) => u.data[1][i] == null ? '' : `${digits(u.data[1][i], 4)} ${units.kN}`,
  })],
};
const whole = () => [course.start, course.stop];
const weights = new Weights($('weights'), {x: whole, log: () => log, shown});
const trends = new Map();

function take(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  // Frames that were on their way when the page was held.
  const late = wanted.stop !== null && head.stop > wanted.stop + 1e-6;
  let at = 4 + length;
  const row = (count) => {
    const found = new Float32Array(buffer, at, count);
    at += 4 * count;
    return found;
  };
  speak(head.units);
  const data = head.rows.map(() => row(head.count));
  const before = last;
  last = head;
  if (head.trends) takeTrends(head, row);
  if (late) { last = before || head; return; }
  course.stop = Math.max(head.newest, course.start + 1e-3);
  const times = Array.from(data[0], (t) => t + head.start);
  // NaN is no gap to uPlot, null is.
  const rows = Object.fromEntries(head.rows.map((name, i) => [name, data[i]]));
  for (const [names, panel] of Object.values(panels)) {
    const curves = names.map((name) => Array.from(rows[name], (v) => v === v ? v : null));
    const nothing = names[0] === 'force' && curves[0].every((v) => v === null);
    if (panel.figure.hidden !== nothing) panel.figure.hidden = nothing;
    if (!nothing) panel.show([times, ...curves]);
  }
  for (const name of ['motion', 'residual']) text(panels[name][1].keys[0], bandName(head.state));
  // The whole test grows even where nothing new is known.
  if (!head.trends && weights.chart && moved(before, head)) for (const one of [weights, ...trends.values()]) one.draw();
  tell(head);
  document.body.dataset.frames = Number(document.body.dataset.frames || 0) + 1;
  document.body.dataset.stop = head.stop;
}

function speak(told) {
  if (units.mm === told.mm) return;
  units = told;
  for (const [, panel] of Object.values(panels)) panel.rename();
}

// Whether the pictures of the whole test change by a pixel.
function moved(before, head) {
  const pixel = (course.stop - course.start) / (weights.box.clientWidth || 500);
  const far = (one, other) => Math.abs(one - other) > pixel;
  if (moved.drawn && !far(moved.drawn.stop, head.stop) && !far(moved.drawn.start, head.start) &&
      !far(moved.drawn.newest, head.newest)) return false;
  moved.drawn = {start: head.start, stop: head.stop, newest: head.newest};
  return true;
}

function takeTrends(head, row) {
  const {count, weights: names, parameters} = head.trends;
  log = head.log;
  const times = Array.from(row(count));
  const rows = names.map(() => row(count));
  course.start = 0;
  course.stop = Math.max(head.newest, 1e-3);
  weights.take(times, names, rows, head.stop);
  if (parameters.length && !trends.size) $('trends').replaceChildren();
  const told = new Set();
  for (const {name, word, unit} of parameters) {
    const [mean, sd, prior] = [row(count), row(count), row(count)];
    told.add(name);
    if (!trends.has(name)) trends.set(name, new Trend($('trends'), word, whole));
    const trend = trends.get(name), value = (v) => v === v ? v : null;
    trend.show([times,
      Array.from(mean, (v, i) => value(v + 2 * sd[i])), Array.from(mean, (v, i) => value(v - 2 * sd[i])),
      Array.from(mean, (v, i) => prior[i] > 0 ? null : value(v)),
      Array.from(mean, (v, i) => prior[i] > 0 ? value(v) : null)]);
    text(trend.now, mean[count - 1] === mean[count - 1]
      ? `${digits(mean[count - 1], 4)} \u00b1 ${digits(sd[count - 1], 2)} ${unit}` : 'not carried now');
  }
  for (const [name, trend] of trends) if (!told.has(name)) { trend.remove(); trends.delete(name); }
  tellLog();
}

function text(place, value) {
  const element = typeof place === 'string' ? $(place) : place;
  if (element.textContent !== value) element.textContent = value;
}
// What a part of the page shows is made anew only where it changes.
function fill(id, key, made) {
  const element = $(id), told = JSON.stringify(key);
  if (element.told === told) return;
  element.told = told;
  element.replaceChildren(...made());
}
const seconds = (t) => `${t.toFixed(1)} s`;
const percent = (share) => share == null ? '-' : `${digits(100 * share, share > 0.995 ? 4 : 2)} %`;

function tell(head) {
  const s = head.state;
  text('title', head.title);
  text('setup', !s.setup ? '' : `${s.setup.actuator}, ` + (s.setup.stiffness == null ? 'specimen stiffness not known'
    : s.setup.stiffness ? `specimen ${digits(s.setup.stiffness / 1e3, 4)} kN/m` : 'no specimen'));
  text('span', wanted.span < 60 ? `${wanted.span} s` : `${wanted.span / 60} min`);
  text('clock', `${head.stop.toFixed(2)} s of ${head.newest.toFixed(2)} s`);
  const slider = $('time');
  slider.min = Math.min(head.oldest + wanted.span, head.newest);
  slider.max = head.newest;
  if (wanted.stop === null) slider.value = head.newest;
  else if (playing) slider.value = wanted.stop;
  explained(s.posterior);
  diagnosed(s.diagnosis);
  fill('parameters', s.posterior || null, () => parameters(s.posterior));
  text('fit', fitted(s.posterior));
  $('fit').className = !s.posterior ? '' : s.posterior.converged && !s.posterior.doubts.length ? 'good' : 'warn';
  text('whose', s.posterior && s.posterior.structures.length > 1 ? 'all explanations, by their weights' : '');
  text('coverage', !s.coverage ? 'no scored band yet' : `${digits(100 * s.coverage.mean, 3)} % inside the ` +
    `${digits(100 * s.coverage.level, 3)} % band over ${s.coverage.windows} window(s), last ` +
    `${digits(100 * s.coverage.last, 3)} %; mean width ${digits(1e3 * s.coverage.width, 3)} ${units.mm}` +
    (s.coverage.forecast ? '; fixed before the data' : ''));
  text('response', !s.response ? 'no frequency response yet' :
    `at ${digits(s.response.frequency, 3)} Hz: delay ` +
    `${digits(1e3 * s.response.delay, 3)} ms, amplitude ${digits(s.response.amplitude, 4)}, ` +
    `phase ${digits(s.response.phase * 180 / Math.PI, 3)}\u00b0`);
  const nodes = Object.entries(s.health || {}).sort();
  fill('health', nodes.map(([name, node]) => [name, node.level, node.message]), () => nodes.length
    ? nodes.map(([name, node]) => make('li', {className: level(node.level), textContent: `${name}: ${node.message}`}))
    : [make('li', {textContent: 'nothing heard yet'})]);
  brief(s);
}

const level = (number) => ['good', 'warn', 'bad'][number] || 'bad';

// The answer in a line, at the top of a phone.
function brief(s) {
  const [first] = s.posterior ? s.posterior.structures : [];
  const lasting = log.filter((entry) => entry.level > 0 && entry.stop == null);
  const parts = [];
  if (first) parts.push(`${first.name} ${percent(first.weight)}` + (first.leads == null ? '' : ` since ${seconds(first.leads)}`));
  if (s.coverage) parts.push(`forecasts ${digits(100 * s.coverage.mean, 3)} % inside`);
  parts.push(!lasting.length ? 'no alarm' : lasting.length === 1 ? '1 alarm' : `${lasting.length} alarms`);
  text('brief', parts.join(' \u00b7 '));
  $('brief').className = lasting.length ? 'warn' : 'good';
}

const size = (p) => `${p.word} ${digits(p.mean, 4)}` + (p.limits
  ? ` (${digits(p.limits[0], 4)} to ${digits(p.limits[1], 4)})`
  : p.sd == null ? '' : ` \u00b1 ${digits(p.sd, 2)}`) + (p.unit ? ` ${p.unit}` : '');

function sizes(of) {
  const items = of.flatMap((p, i) => [...(i ? [', '] : []), make('span', {textContent: size(p)})]);
  return make('p', {className: 'sizes'}, ...items);
}

// Which explanation, how sure, since when, and what the parameters are if it is true.
function explained(posterior) {
  if (!posterior) return fill('explanations', null, () => [make('p', {textContent: 'no posterior yet'})]);
  fill('explanations', [posterior.structures, weights.names], () => posterior.structures.flatMap((one) => {
    const swatch = make('span', {className: 'swatch'});
    swatch.style.setProperty('--swatch', weights.colors[weights.names.indexOf(one.name)] || OTHERS);
    const since = [one.since == null ? '' : `carried since ${seconds(one.since)}`,
      one.leads == null || one.leads === one.since ? '' : `above one half since ${seconds(one.leads)}`].filter(Boolean).join(', ');
    const found = [make('p', {className: 'share'}, swatch,
      make('span', {}, one.name, make('small', {textContent: since ? ` \u2013 ${since}` : ''})),
      make('b', {textContent: percent(one.weight)}))];
    if (one.parameters.length && posterior.structures.length > 1) {
      const told = sizes(one.parameters);
      told.prepend('if true: ');
      found.push(told);
    }
    return found;
  }));
}

function diagnosed(found) {
  text('diagnosis', !found ? 'none yet' : `${seconds(found.at)}: ${found.summary}` + (found.reason ? ` \u2013 ${found.reason}` : ''));
  fill('tied', found ? found.effects : [], () => (found ? found.effects : []).flatMap((effect) =>
    [effect, ...effect.tied].flatMap((one, i) => {
      const line = make('p', {className: 'share'}, make('span', {}, i ? `or ${one.name}` : one.name),
        make('b', {textContent: one.probability == null ? '' : percent(one.probability)}));
      const told = one.sizes.length ? [sizes(one.sizes)] : [];
      if (told.length) told[0].prepend('if true: ');
      return [line, ...told];
    })));
  const tests = found ? found.experiments : [], advice = found ? found.advice : [];
  fill('next', tests, () => tests.map((test, i) => make('p', {},
    make('b', {textContent: i ? 'or ' : 'Next experiment: '}), test)));
  fill('advice', advice, () => advice.map((line) => make('li', {textContent: line})));
  if ($('more').hidden !== !advice.length) $('more').hidden = !advice.length;
}

function cells(row, values, tag) {
  for (const value of values) row.append(make(tag, {textContent: value}));
  return row;
}

function parameters(posterior) {
  if (!posterior) return [make('tbody', {}, cells(make('tr'), ['no posterior yet'], 'td'))];
  const rows = [cells(make('tr'), ['', 'mean', '\u00b1 s. d.', 'unit'], 'th')];
  for (const p of posterior.parameters) {
    const row = cells(make('tr'), [p.word, digits(p.mean, 4), digits(p.sd, 3), p.unit], 'td');
    if (p.prior) { row.className = 'prior'; row.title = 'little more than the prior'; }
    rows.push(row);
  }
  return [make('tbody', {}, ...rows)];
}

function fitted(posterior) {
  return !posterior ? '' : `window ${posterior.window}: R-hat ${digits(posterior.rhat, 4)}, ESS ` +
    `${digits(posterior.ess, 3)}, error ${digits(100 * posterior.nrmse, 3)} % of the spread, ` +
    `${digits(posterior.seconds, 3)} s` +
    (posterior.doubts.length ? `; doubtful: ${posterior.doubts.join(', ')}` : '') +
    (posterior.parameters.some((p) => p.prior) ? '; grey: little more than the prior' : '');
}

function tellLog() {
  fill('log', log, () => log.length ? log.map((entry) => {
    const time = make('time', {textContent: seconds(entry.start)});
    time.addEventListener('click', () => goTo(entry.start));
    const end = !entry.level ? '' : entry.stop == null ? ', lasts' :
      entry.stop > entry.start ? ` to ${seconds(entry.stop)}` : '';
    return make('li', {className: entry.level ? level(entry.level) : ''}, time, `${end} ${entry.of}: ${entry.text}`);
  }) : [make('li', {textContent: 'nothing yet'})]);
}

function ask() {
  wanted.points = Math.round(2 * Math.min(panels.motion[1].box.clientWidth || 700, 1600));
  const request = JSON.stringify(wanted);
  if (socket && socket.readyState === WebSocket.OPEN && request !== asked) {
    asked = request;
    socket.send(request);
  }
}

function follow(on) {
  if (playing) { clearInterval(playing); playing = null; }
  if (on && last && !last.live) {  // a bag: its own time goes by
    if (wanted.stop === null || wanted.stop >= last.newest) wanted.stop = Number($('time').min);
    let before = performance.now();
    playing = setInterval(() => {
      const now = performance.now();
      wanted.stop = Math.min(wanted.stop + (now - before) / 1e3, last.newest);
      before = now;
      ask();
      if (wanted.stop >= last.newest) follow(false);
    }, 50);
  } else if (on) wanted.stop = null;
  else if (last) wanted.stop = last.stop;
  text('run', on ? 'Pause' : (last && last.live ? 'Follow' : 'Play'));
  ask();
}

// Show what was known at a time [s].
function goTo(time) {
  if (!last) return;
  if ($('run').textContent === 'Pause') follow(false);
  wanted.stop = Math.min(Math.max(time, Number($('time').min)), last.newest);
  $('time').value = wanted.stop;
  ask();
}

// Show the next smaller (-1) or larger (1) stretch; of what stands still, that at a share of the
// picture stays where it is.
function zoom(step, share) {
  const span = SPANS[Math.min(Math.max(SPANS.indexOf(wanted.span) + step, 0), SPANS.length - 1)];
  if (wanted.stop !== null && share != null) {
    const time = wanted.stop - (1 - share) * wanted.span;
    wanted.stop = Math.min(time + (1 - share) * span, last.newest);
    $('time').value = wanted.stop;
  }
  wanted.span = span;
  ask();
}
const move = (spans) => goTo((wanted.stop === null ? last.newest : wanted.stop) + spans * wanted.span);

$('run').addEventListener('click', () => follow($('run').textContent !== 'Pause'));
$('closer').addEventListener('click', () => zoom(-1, 0.5));
$('wider').addEventListener('click', () => zoom(1, 0.5));
$('time').addEventListener('input', () => goTo(Number($('time').value)));
for (const [, panel] of Object.values(panels)) gestures(panel.box, move, zoom);
$('course').addEventListener('click', (event) => {
  const box = event.target.closest('.chart');
  if (!box || !last) return;
  goTo(course.start + (course.stop - course.start) * across(event, box));
});
const KEYS = {
  ' ': () => follow($('run').textContent !== 'Pause'),
  ArrowLeft: () => move(-0.1), ArrowRight: () => move(0.1),
  '+': () => zoom(-1, 0.5), '=': () => zoom(-1, 0.5), '-': () => zoom(1, 0.5),
  Home: () => goTo(0), End: () => last && last.live ? follow(true) : goTo(Infinity),
};
document.addEventListener('keydown', (event) => {
  if (!KEYS[event.key] || event.ctrlKey || event.metaKey || event.altKey || !last) return;
  if (event.target.closest('button') && event.key === ' ') return;  // presses that button
  event.preventDefault();
  KEYS[event.key]();
});
new ResizeObserver(ask).observe($('samples'));

function connect() {
  socket = new WebSocket(`ws://${location.host}/socket`);
  socket.binaryType = 'arraybuffer';
  let first = true;
  socket.onopen = () => { asked = ''; text('link', 'connected'); $('link').className = 'good'; ask(); };
  socket.onmessage = (event) => {
    take(event.data);
    if (first && !last.live) text('run', 'Play');
    if (first) { first = false; ask(); }
  };
  socket.onclose = () => {
    text('link', 'no connection'); $('link').className = 'bad';
    setTimeout(connect, 1000);
  };
}
connect();
