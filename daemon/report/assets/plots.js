'use strict';
// Draws <figure data-plot="ID"> with dygraphs. Names come from outside: they are only ever set as text.
const thermbalPlots = (() => {
  const drawn = {};  // id -> Dygraph, for those who look at the page from outside
  const colour = name => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
  const finite = value => typeof value === 'number' && isFinite(value);

  function columnsOf(plot, table) {
    return plot.lines.map(line => table.columns[line.column]);
  }

  // Without the rows before and after everything that is shown.
  function rowsOf(plot, table) {
    const columns = columnsOf(plot, table);
    const rows = table.x.map((x, i) => [x, ...columns.map(column => column[i])]);
    const shown = row => row.slice(1).some(finite);
    let from = rows.findIndex(shown), to = rows.length;
    if (from < 0) return [];
    while (to > from && !shown(rows[to - 1])) --to;
    return rows.slice(from, to);
  }

  const digitsFor = span => span < 0.05 ? 4 : span < 0.5 ? 3 : span < 5 ? 2 : span < 50 ? 1 : 0;
  const trimmed = text => text.includes('.') ? text.replace(/\.?0+$/, '') : text;

  function underlay(shown) {
    return (context, area, graph) => {
      const {plot, table} = shown;
      const x = value => value === null ? null : Math.min(Math.max(graph.toDomXCoord(value), area.x), area.x + area.w);
      const y = value => Math.min(Math.max(graph.toDomYCoord(value), area.y), area.y + area.h);
      for (const strip of plot.strips) {
        const left = x(strip.from_x) ?? area.x, right = x(strip.to_x) ?? area.x + area.w;
        context.globalAlpha = 0.16;
        context.fillStyle = colour(strip.colour);
        context.fillRect(left, y(strip.high), right - left, y(strip.low) - y(strip.high));
      }
      for (const band of plot.bands) {
        const low = table.columns[band.low], high = table.columns[band.high];
        const there = table.x.map((_, i) => i).filter(i => finite(low[i]) && finite(high[i]));
        context.globalAlpha = 0.13;
        context.fillStyle = colour(band.colour);
        context.beginPath();
        there.forEach(i => context.lineTo(x(table.x[i]), y(high[i])));
        there.reverse().forEach(i => context.lineTo(x(table.x[i]), y(low[i])));
        context.fill();
      }
      context.globalAlpha = 1;
      context.font = '11px system-ui, sans-serif';
      context.fillStyle = context.strokeStyle = colour('muted');
      for (const mark of plot.marks) {
        const at = graph.toDomXCoord(mark.x);
        if (at < area.x || at > area.x + area.w) continue;
        context.setLineDash([2, 3]);
        context.beginPath();
        context.moveTo(at, area.y);
        context.lineTo(at, area.y + area.h);
        context.stroke();
        context.setLineDash([]);
        const left = at + 4 + context.measureText(mark.label).width > area.x + area.w;
        context.textAlign = left ? 'right' : 'left';
        context.fillText(mark.label, at + (left ? -4 : 4), area.y + 10);
      }
    };
  }

  // Sorted labels that would lie on each other become a stack about the middle of where they belong.
  function spread(labels, apart, bottom) {
    const stacks = [];
    labels.forEach(label => {
      stacks.push({top: label.at, labels: [label]});
      for (let last = stacks.length - 1; last > 0; --last) {
        const above = stacks[last - 1], below = stacks[last];
        const needed = above.labels.length * apart;
        if (above.top + needed <= below.top) break;
        const a = above.labels.length, b = below.labels.length;
        above.top = (a * above.top + b * (below.top - needed)) / (a + b);
        above.labels.push(...below.labels);
        stacks.pop();
      }
    });
    for (const stack of stacks) {
      const top = Math.min(stack.top, bottom - (stack.labels.length - 1) * apart);
      stack.labels.forEach((label, i) => { label.at = top + i * apart; });
    }
  }

  // Names at the right ends, pushed apart where they would lie on each other.
  function labelLines(figure, plot, graph) {
    if (!plot.label_lines) return;
    const apart = 12, labels = [], area = graph.getArea();
    const [, to] = graph.xAxisRange();
    plot.lines.forEach((line, i) => {
      for (let row = graph.numRows() - 1; row >= 0; --row) {
        const value = graph.getValue(row, i + 1);
        if (graph.getValue(row, 0) > to || !finite(value)) continue;
        const at = graph.toDomYCoord(value);
        if (at >= area.y - 1 && at <= area.y + area.h + 1) labels.push({at, text: line.label});
        return;
      }
    });
    labels.sort((a, b) => a.at - b.at);
    spread(labels, apart, area.y + area.h);
    figure.querySelector('.ends').replaceChildren(...labels.map(label => {
      const span = document.createElement('span');
      span.textContent = label.text;
      span.style.left = area.x + area.w + 5 + 'px';
      span.style.top = label.at + 'px';
      return span;
    }));
  }

  // A finger scrolls the page; two zoom.
  function interaction() {
    const own = Dygraph.defaultInteractionModel, touches = {};
    for (const kind of ['touchstart', 'touchmove', 'touchend']) {
      touches[kind] = (event, graph, context) => {
        if (event.touches.length > 1 || (context.initialTouches || []).length > 1) own[kind](event, graph, context);
      };
    }
    return Object.assign({}, own, touches);
  }

  function strokeOf(line) {
    return {
      color: colour(line.colour),
      strokePattern: line.stroke === 'dashed' ? [5, 4] : null,
      strokeWidth: line.stroke === 'dots' ? 0 : 1.25,
      drawPoints: line.stroke === 'dots',
      pointSize: 2.5,
    };
  }

  function readout(shown, output) {
    return (event, x, points) => {
      const {plot, table} = shown;
      const digits = plot.unit === 'W' ? 1 : 3;
      const values = points.filter(point => finite(point.yval)).map(point => {
        const line = plot.lines[Number(point.name) - 1];
        return line.label + '\u00a0' + point.yval.toFixed(digits);
      });
      const at = table.x_label === 'n' ? 'n = ' + x : trimmed(x.toFixed(2)) + ' ' + table.x_label;
      output.textContent = at + ': ' + (values.length > 4 ? values.slice(0, 4).join(', ') + ' …' : values.join(', ')) +
        (values.length ? ' ' + plot.unit : 'no value');
    };
  }

  // Plots of the same table in the same section show the same stretch.
  function zoomTogether(figure, plot) {
    return (from, to) => {
      const group = figure.closest('section') || document;
      for (const other of group.querySelectorAll('figure[data-plot]')) {
        const graph = drawn[other.dataset.plot];
        if (other === figure || !graph || graph.thermbal.plot.table !== plot.table) continue;
        graph.updateOptions({dateWindow: [from, to]});
      }
    };
  }

  function optionsOf(shown, figure, output) {
    const {plot, table} = shown;
    const series = {};
    plot.lines.forEach((line, i) => { series[String(i + 1)] = strokeOf(line); });
    const oneByOne = plot.label_lines;
    const say = readout(shown, output);
    return {
      labels: ['x', ...plot.lines.map((_, i) => String(i + 1))],
      series,
      legend: 'never',
      xlabel: table.x_label,
      ylabel: plot.unit,
      xLabelHeight: 16,
      yLabelWidth: 16,
      rightGap: oneByOne ? 44 : 8,
      valueRange: plot.range,
      gridLineColor: colour('line'),
      axisLineColor: colour('line'),
      axisLabelFontSize: 11,
      axes: {
        x: {axisLabelFormatter: value => trimmed(Number(value).toFixed(2)), pixelsPerLabel: 60, drawGrid: false},
        y: {
          axisLabelFormatter: (value, _, __, graph) => {
            const [low, high] = graph.yAxisRange();
            return trimmed(Number(value).toFixed(digitsFor(high - low)));
          },
          pixelsPerLabel: 26,
          axisLabelWidth: 40,
        },
      },
      highlightCircleSize: oneByOne ? 0 : 2.5,
      highlightSeriesOpts: oneByOne ? {strokeWidth: 3, highlightCircleSize: 3} : null,
      highlightSeriesBackgroundAlpha: 0.5,
      highlightSeriesBackgroundColor: colour('card'),
      highlightCallback: oneByOne
        ? (event, x, points, row, name) => say(event, x, points.filter(point => point.name === name))
        : say,
      unhighlightCallback: () => { output.textContent = ''; },
      underlayCallback: underlay(shown),
      drawCallback: graph => { if (figure.querySelector('.ends')) labelLines(figure, shown.plot, graph); },
      zoomCallback: zoomTogether(figure, plot),
      interactionModel: interaction(),
      animatedZooms: false,
    };
  }

  // Draws a figure, or draws it anew with what has come since; a stretch that is zoomed to stays.
  function draw(figure, plot, table) {
    const rows = rowsOf(plot, table);
    const output = figure.querySelector('output');
    figure.classList.toggle('empty', !rows.length);
    if (!rows.length) {
      output.textContent = 'no values yet';
      return null;
    }
    const old = drawn[figure.dataset.plot];
    if (old && old.thermbal.plot.lines.length === plot.lines.length) {
      Object.assign(old.thermbal, {plot, table});
      old.updateOptions(Object.assign({file: rows}, old.isZoomed('x') ? {} : {valueRange: plot.range}));
      return old;
    }
    if (old) old.destroy();
    output.textContent = '';
    const shown = {plot, table};
    const graph = new Dygraph(figure.querySelector('.live'), rows, optionsOf(shown, figure, output));
    graph.thermbal = shown;
    const ends = document.createElement('div');
    ends.className = 'ends';
    figure.querySelector('.live').append(ends);
    labelLines(figure, plot, graph);
    drawn[figure.dataset.plot] = graph;
    return graph;
  }

  function drawPage() {
    const {tables, plots} = JSON.parse(document.getElementById('plots').textContent);
    const root = document.documentElement;
    root.classList.add('script');  // from here on the still pictures are for paper
    const drawOne = figure => {
      const plot = plots[figure.dataset.plot];
      try {
        draw(figure, plot, tables[plot.table]);
      } catch (error) {
        figure.classList.add('failed');  // shows the still picture
        console.error(figure.dataset.plot, error);
      }
    };
    const soon = new IntersectionObserver(entries => {
      for (const entry of entries) {
        if (!entry.isIntersecting) continue;
        soon.unobserve(entry.target);
        drawOne(entry.target);
      }
    }, {rootMargin: '400px'});
    document.querySelectorAll('figure[data-plot]').forEach(figure => soon.observe(figure));
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => location.reload());
    addEventListener('beforeprint', () => document.querySelectorAll('details').forEach(one => { one.open = true; }));
  }

  return {draw, drawPage, drawn};
})();
