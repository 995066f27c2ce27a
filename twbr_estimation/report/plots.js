// Draws the plots of a report from their descriptions, see plots.py.
function drawPlots({values: encoded, plots}) {
  const values = encoded.map(text =>
    new Float32Array(Uint8Array.from(atob(text), letter => letter.charCodeAt(0)).buffer));
  const page = new Bokeh.Document(), drawn = {};
  for (const [place, description] of Object.entries(plots)) {
    drawn[place] = figureOf(description, values, drawn);
    page.add_root(drawn[place]);
  }
  const places = Object.keys(plots).map(place => document.getElementById(place));
  return Bokeh.embed.add_document_standalone(page, document.body, places);
}

// A plot as wide as the page; on touch screens a drag scrolls the page.
function figureOf({zoom, options: {x_range_of, ...options}, lines, legend}, values, drawn) {
  const box = new Bokeh.BoxZoomTool({dimensions: zoom});
  const plot = Bokeh.Plotting.figure({
    tools: [new Bokeh.PanTool({dimensions: zoom}), box, new Bokeh.WheelZoomTool({dimensions: zoom}),
            new Bokeh.ResetTool(), new Bokeh.SaveTool()],
    active_drag: box,
    active_scroll: null,
    sizing_mode: "stretch_width",
    toolbar_location: "above",
    output_backend: "canvas",
    ...(x_range_of && {x_range: drawn[x_range_of].x_range}),
    ...options,
  });
  plot.toolbar.logo = null;
  plot.y_range.only_visible = true;
  for (const axis of plot.axes) axis.axis_label_text_font_style = "normal";
  const line = ({x, y, style, name = null, visible = true}) => new Bokeh.GlyphRenderer({
    data_source: new Bokeh.ColumnDataSource({data: {x: values[x], y: values[y]}}),
    glyph: new Bokeh.Line({x: {field: "x"}, y: {field: "y"}, ...style}),
    nonselection_glyph: null,
    muted_glyph: null,
    name,
    visible,
  });
  plot.add_renderers(...lines.map(line));
  const labelled = legend.map(line);
  plot.add_renderers(...labelled);
  if (labelled.length)
    plot.add_layout(new Bokeh.Legend({
      location: "bottom_left",
      background_fill_alpha: 0.7,
      items: labelled.map((renderer, index) =>
        new Bokeh.LegendItem({label: {value: legend[index].label}, renderers: [renderer]})),
    }));
  return plot;
}
