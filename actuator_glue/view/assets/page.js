'use strict';
// The page holds nothing but what it shows: whatever is scrolled to is asked of the server.
const $ = (id) => document.getElementById(id);
const wanted = {stop: null, span: 10, points: 1500};
let socket = null, chart = null, last = null, shown = null, playing = null, asked = '';
const measured = '#12324f', band = 'rgba(66, 133, 190, 0.35)', edge = 'rgba(66, 133, 190, 0.8)';

const line = (label, stroke, width, dash) =>
  ({label, stroke, width, dash, points: {show: false}, spanGaps: false,
    value: (_, v) => v == null ? '' : v.toFixed(4)});

// What is measured is drawn last, so that no band hides it.
const DRAWN = ['time', 'lower', 'median', 'upper', 'command', 'measured'];

function bandName(head) {
  const told = head.state.coverage;
  const level = told && told.level != null ? `${digits(100 * told.level, 3)} % band` : 'band';
  return told && told.forecast ? `${level}, fixed before the data` : level;
}

function draw(data) {
  const box = $('chart').getBoundingClientRect();
  const legend = chart && chart.root.querySelector('.u-legend');
  const size = {
    width: Math.max(Math.floor(box.width), 100),
    height: Math.max(Math.floor(box.height - (legend ? legend.offsetHeight : 60)), 100),
  };
  shown = data;
  if (!chart) {
    chart = new uPlot({
      ...size,
      scales: {x: {time: false, auto: false, range: () => [last.start, last.stop]}},
      axes: [{label: 'time [s]'}, {label: 'displacement [mm]'}],
      legend: {live: true, markers: {fill: (u, i) => i === 1 ? band : u.series[i].stroke(u, i)}},
      // The two limits of the band are one thing: one name, shown and hidden together.
      hooks: {setSeries: [(u, i, to) => { if (i === 1 && to.show != null) u.setSeries(3, {show: to.show}); }]},
      cursor: {drag: {x: false, y: false}},
      series: [
        {label: 'time [s]', value: (_, v) => v == null ? '' : v.toFixed(3)},
        {...line('band', edge, 0.6), value: (u, v, _, i) =>
          v == null ? '' : `${v.toFixed(4)} to ${u.data[3][i].toFixed(4)}`},
        line('median of the forecast', edge, 0.8, [2, 3]), line('upper limit', edge, 0.6),
        line('command', '#9aa5b1', 1, [4, 3]), line('measured', measured, 1.4),
      ],
      bands: [{series: [3, 1], fill: band}],
    }, data, $('chart'));
    draw(data);  // now the legend has a height
  } else {
    if (chart.width !== size.width || chart.height !== size.height) chart.setSize(size);
    chart.setData(data);
    text(chart.root.querySelectorAll('.u-label')[1], bandName(last));
  }
}

function take(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  // Frames that were on their way when the page was held.
  if (wanted.stop !== null && head.stop > wanted.stop + 1e-6) return;
  const data = head.rows.map((_, i) =>
    new Float32Array(buffer, 4 + length + 4 * i * head.count, head.count));
  last = head;
  const times = Array.from(data[0], (t) => t + head.start);
  // NaN is no gap to uPlot, null is.
  const row = (name) => Array.from(data[head.rows.indexOf(name)], (v) => v === v ? v : null);
  draw([times, ...DRAWN.slice(1).map(row)]);
  tell(head);
  document.body.dataset.frames = Number(document.body.dataset.frames || 0) + 1;
  document.body.dataset.stop = head.stop;
}

function text(place, value) {
  const element = typeof place === 'string' ? $(place) : place;
  if (element.textContent !== value) element.textContent = value;
}
const digits = (v, n) => v == null ? '-' :
  v && (Math.abs(v) < 1e-3 || Math.abs(v) >= 1e5) ? v.toExponential(n - 1) : String(Number(v.toPrecision(n)));

function tell(head) {
  const s = head.state;
  text('title', head.title);
  text('setup', !s.setup ? '' : `${s.setup.actuator}, specimen ${s.setup.stiffness == null
    ? 'stiffness not known' : `${digits(s.setup.stiffness / 1e3, 4)} kN/m`}`);
  text('clock', `${head.stop.toFixed(2)} s of ${head.newest.toFixed(2)} s`);
  const slider = $('time');
  slider.min = Math.min(head.oldest + wanted.span, head.newest);
  slider.max = head.newest;
  if (wanted.stop === null) slider.value = head.newest;
  else if (playing) slider.value = wanted.stop;
  if (s.posterior) parameters(s.posterior);
  if (s.coverage) text('coverage', `${digits(100 * s.coverage.mean, 3)} % inside the ` +
    `${digits(100 * s.coverage.level, 3)} % band over ${s.coverage.windows} window(s), last ` +
    `${digits(100 * s.coverage.last, 3)} %; mean width ${digits(1e3 * s.coverage.width, 3)} mm` +
    (s.coverage.forecast ? '; fixed before the data' : ''));
  if (s.response) text('response', `at ${digits(s.response.frequency, 3)} Hz: delay ` +
    `${digits(1e3 * s.response.delay, 3)} ms, amplitude ${digits(s.response.amplitude, 4)}, ` +
    `phase ${digits(s.response.phase * 180 / Math.PI, 3)}\u00b0`);
  if (s.diagnosis) text('diagnosis', [s.diagnosis.summary, ...s.diagnosis.advice].join(' - '));
  if (s.health) health(s.health);
}

function cells(row, values, tag) {
  for (const value of values) {
    const cell = document.createElement(tag);
    cell.textContent = value;
    row.append(cell);
  }
  return row;
}

function parameters(posterior) {
  const rows = [cells(document.createElement('tr'), ['', 'mean', '\u00b1 s. d.', 'unit'], 'th')];
  for (const p of posterior.parameters) {
    const row = cells(document.createElement('tr'), [p.name, digits(p.mean, 4), digits(p.sd, 3), p.unit], 'td');
    if (p.prior) { row.className = 'prior'; row.title = 'little more than the prior'; }
    rows.push(row);
  }
  $('parameters').tBodies[0].replaceChildren(...rows);
  const fit = $('fit');
  fit.className = posterior.converged ? 'good' : 'warn';
  text('fit', `window ${posterior.window}: R-hat ${digits(posterior.rhat, 4)}, ESS ` +
    `${digits(posterior.ess, 3)}, error ${digits(100 * posterior.nrmse, 3)} % of the spread, ` +
    `${digits(posterior.seconds, 3)} s` +
    (posterior.effects.length ? `; with ${posterior.effects.join(', ')}` : ''));
}

function health(nodes) {
  $('health').replaceChildren(...Object.entries(nodes).sort().map(([name, node]) => {
    const item = document.createElement('li');
    item.className = ['good', 'warn', 'bad'][Number(node.level)] || 'bad';
    item.textContent = `${name}: ${node.message}`;
    return item;
  }));
}

function ask() {
  wanted.points = Math.round(2 * Math.min($('chart').clientWidth || 700, 1600));
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

$('run').addEventListener('click', () => follow($('run').textContent !== 'Pause'));
$('span').addEventListener('change', () => { wanted.span = Number($('span').value); ask(); });
$('time').addEventListener('input', () => {
  const place = Number($('time').value);
  if ($('run').textContent === 'Pause') follow(false);
  wanted.stop = place;
  ask();
});

new ResizeObserver(() => { if (shown) draw(shown); ask(); }).observe($('chart'));

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
