'use strict';
// The page of `thermbalctl dashboard`: what the daemon says, as it comes (server-sent events). Everything that
// comes from outside is set as text.
(() => {
  const at = id => document.getElementById(id);
  const finite = value => typeof value === 'number' && isFinite(value);
  const fixed = (value, digits = 2) => finite(value) ? value.toFixed(digits) : '-';
  const signed = (value, digits = 1) => finite(value) ? (value > 0 ? '+' : '') + value.toFixed(digits) : '-';
  const duration = minutes => !finite(minutes) ? '-' : Math.abs(minutes) < 600 ? minutes.toFixed(0) + '\u00a0min' : (minutes / 60).toFixed(1) + '\u00a0h';
  const words = name => (name || '').replaceAll('_', ' ');

  let scene = {status: {}, channels: [], predictions: [], events: []};
  let history = {names: [], x: [], columns: {}};
  let chosen = null;

  function cell(text, className) {
    const td = document.createElement('td');
    td.textContent = text;
    if (className) td.className = className;
    return td;
  }

  // On a phone the place stands below the name.
  function named(channel) {
    const td = document.createElement('td'), b = document.createElement('b'), small = document.createElement('small');
    b.textContent = channel.channel;
    small.textContent = channel.place || '';
    small.className = 'phone';
    td.append(b, small);
    return td;
  }

  function fact(value, what) {
    const div = document.createElement('div'), b = document.createElement('b'), span = document.createElement('span');
    b.textContent = value;
    span.textContent = what;
    div.append(b, span);
    return div;
  }

  const isWaitedFor = channel => channel.required && channel.role !== 'ambient' && channel.state !== 'barely_warming';

  function showVerdict() {
    const {status} = scene, test = status.test;
    const waited = scene.channels.filter(isWaitedFor);
    const declared = waited.filter(channel => channel.state === 'declared');
    const all = waited.length > 0 && declared.length === waited.length;
    const slowest = Math.max(...declared.map(channel => channel.equilibrium_time_min).filter(finite), -Infinity);
    at('verdict').className = 'verdict' + (status.state === 'aborted' ? ' bad' : all ? '' : ' open');
    at('headline').textContent = !test ? 'No test yet' : all ? `All ${waited.length} channels known`
      : `${declared.length} of ${waited.length} channels known`;
    at('who').textContent = [test && test.name, status.machine, status.state, test && test.reason].filter(Boolean).join(' · ');
    at('facts').replaceChildren(...(!test ? [] : [
      fact(duration(test.time_min), `measured, ${test.scans} scans`),
      fact(finite(slowest) ? duration(slowest) : '-', 'thermal balance of the channels known so far'),
      ...(test.model ? [fact(words(test.model.state), `simulation and measurement, model ${test.model.name}`)] : []),
      fact(`${status.good_channels ?? '-'} / ${scene.channels.length}`, 'channels with a good reading'),
    ]));
  }

  function showChannels() {
    const compared = scene.channels.some(channel => finite(channel.residual_C));
    at('residual').hidden = !compared;
    at('channels').replaceChildren(...scene.channels.map(channel => {
      const tr = document.createElement('tr');
      const good = channel.quality === 'good', known = channel.state === 'declared';
      tr.append(
        named(channel), cell(channel.place || '', 'place wide'),
        cell(good ? fixed(channel.value_C) : words(channel.quality), good ? 'number' : 'number bad'),
        cell(good ? signed(channel.rate_C_per_h) : '-', 'number wide'),
        ...(compared ? [cell(signed(channel.residual_C, 2), channel.disagrees ? 'number bad' : 'number')] : []),
        cell(fixed(channel.steady_state_C), known ? 'number good' : 'number quiet'),
        cell(finite(channel.steady_state_low_C) ? `${fixed(channel.steady_state_low_C)} – ${fixed(channel.steady_state_high_C)}` : '-', 'number wide'),
        cell(duration(channel.time_left_min), 'number wide'),
        cell(channel.role === 'ambient' ? 'room' : words(channel.state) || '-', known ? 'good' : 'quiet'));
      tr.tabIndex = 0;
      tr.className = 'choice';
      tr.setAttribute('aria-selected', String(channel.channel === chosen));
      const choose = () => { chosen = channel.channel; showAll(); };
      tr.addEventListener('click', choose);
      tr.addEventListener('keydown', event => { if (event.key === 'Enter') choose(); });
      return tr;
    }));
  }

  function rangeOf(plot, table) {
    let low = Infinity, high = -Infinity;
    const take = value => { if (finite(value)) { low = Math.min(low, value); high = Math.max(high, value); } };
    plot.lines.forEach(line => table.columns[line.column].forEach(take));
    plot.strips.forEach(strip => { take(strip.low); take(strip.high); });
    const margin = Math.max(0.06 * (high - low), 0.02);
    return low <= high ? [low - margin, high + margin] : [0, 1];
  }

  function draw(id, unit, lines, table, more = {}) {
    const plot = Object.assign({table: id, unit, lines, bands: [], strips: [], marks: [], label_lines: false}, more);
    plot.range = rangeOf(plot, table);
    thermbalPlots.draw(document.querySelector(`figure[data-plot="${id}"]`), plot, table);
  }

  const courses = () => ({x_label: 'min', x: history.x, columns: history.columns});

  function showPlots() {
    const shown = scene.channels.filter(channel => history.columns[channel.channel]);
    if (!shown.length) return;
    draw('overview', '°C', shown.map(channel => ({
      label: channel.channel, column: channel.channel, colour: channel.role === 'ambient' ? 'muted' : 'ink',
      stroke: channel.role === 'ambient' ? 'dashed' : 'solid'})), courses(), {label_lines: true});
  }

  function showChannel() {
    const verdict = scene.predictions.find(one => one.channel === chosen);
    const channel = scene.channels.find(one => one.channel === chosen);
    at('channel').hidden = !channel;
    if (!channel || !history.columns[chosen]) return;
    at('name').textContent = [channel.channel, channel.place].filter(Boolean).join('  ');
    at('sentence').textContent = verdict ? verdict.reason : 'Not identified yet.';
    const known = verdict && finite(verdict.steady_state_low_C);
    draw('course', '°C', [{label: 'measured', column: chosen, colour: 'ink', stroke: 'solid'}], courses(), {
      strips: known ? [{from_x: verdict.window_end_min, to_x: null, low: verdict.steady_state_low_C, high: verdict.steady_state_high_C, colour: 'accent'}] : [],
      marks: known ? [{x: verdict.window_end_min, label: verdict.declared ? 'declared' : 'newest window'}] : []});
    const rmse = verdict ? verdict.rmse_by_n_C : [];
    draw('rmse', '°C', [{label: 'RMSE of the window', column: 'rmse', colour: 'ink', stroke: 'solid'},
      {label: `chosen, n = ${verdict ? verdict.n : '-'}`, column: 'chosen', colour: 'accent', stroke: 'dots'}],
      {x_label: 'n', x: rmse.map((_, i) => i + 1),
        columns: {rmse, chosen: rmse.map((value, i) => i + 1 === verdict.n ? value : null)}});
    at('guards').replaceChildren(...(verdict ? verdict.guards : []).map(guard => {
      const tr = document.createElement('tr');
      tr.append(cell(guard.passed ? 'holds' : 'fails', guard.passed ? 'good' : 'bad'), cell(words(guard.name)), cell(guard.figures));
      return tr;
    }));
  }

  function showEvents() {
    at('events').replaceChildren(...scene.events.slice(-50).reverse().map(event => {
      const tr = document.createElement('tr');
      tr.append(cell(finite(event.time_s) ? (event.time_s / 60).toFixed(2) + ' min' : '-', 'number'), cell(words(event.kind), 'wide'), cell(event.message));
      return tr;
    }));
  }

  function showAll() {
    at('trouble').textContent = scene.trouble || '';
    showVerdict();
    showChannels();
    showPlots();
    showChannel();
    showEvents();
  }

  function take(message) {
    if (message.history) history = message.history;
    for (const row of message.rows || []) {
      history.x.push(row[0]);
      history.names.forEach((name, i) => history.columns[name].push(row[i + 1]));
    }
    delete message.history;
    delete message.rows;
    scene = message;
    showAll();
  }

  const source = new EventSource('live');
  source.onmessage = event => take(JSON.parse(event.data));
  source.onerror = () => { at('trouble').textContent = 'The connection to the dashboard is lost; trying again.'; };
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => location.reload());
})();
