"""The template of the page of report.py."""

# `$name` and `${name}` are placeholders of string.Template; `$$` is a dollar sign.
PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
  :root { color: #22262b; background: #fff; font: 15px/1.5 system-ui, sans-serif; }
  body { max-width: 1100px; margin: 0 auto; padding: 1.2rem; }
  h1 { font-size: 1.6rem; margin: 0; }
  h2 { font-size: 1.15rem; margin: 2rem 0 .6rem; border-bottom: 1px solid #d5dae0; }
  .ending { color: #c0392b; font-weight: 600; }
  .quiet { color: #66707a; }
  .pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); gap: 1.2rem; }
  img { max-width: 100%; height: auto; display: block; margin: auto; }
  table { border-collapse: collapse; }
  td, th { padding: .15rem .9rem .15rem 0; text-align: left; vertical-align: top;
           font-weight: normal; }
  td.number { text-align: right; font-variant-numeric: tabular-nums; }
  .facts td:nth-child(2) { text-align: right; font-variant-numeric: tabular-nums; }
  pre { background: #f4f6f8; padding: .8rem; overflow-x: auto; font-size: 13px; }
  .slider { display: flex; gap: .8rem; align-items: center; margin: .6rem 0; }
  .slider input { flex: 1; }
  .slider output { min-width: 8rem; font-variant-numeric: tabular-nums; }
  th { border-bottom: 1px solid #d5dae0; color: #66707a; }
  @media (max-width: 480px) {
    .pair { grid-template-columns: minmax(0, 1fr); }
    table { display: block; overflow-x: auto; }
  }
</style>
</head>
<body>
<h1>$title</h1>
<p class="quiet">$byline</p>
<p class="quiet">$subtitle</p>
<p class="ending">$ending</p>
<p>$model</p>
<div class="pair"><div class="facts">$facts</div><div>$setting</div></div>
<h2>Governing values</h2>
$governing
<h2>Body, materials, supports</h2>
$body
$slider
<h2>Last state</h2>
$pictures
<h2>In time</h2>
$histories
<h2>Errors</h2>
<p>Estimated relative errors of the last state.</p>
$errors
<p>Worst relative KKT residuals of all steps:</p>
$residuals
$notes
<h2>Scene</h2>
<pre>$scene</pre>
<h2>Time taken</h2>
$timings
<h2>What made it</h2>
$provenance
</body>
</html>
"""

SLIDER = """<h2 class="frames">Frames</h2>
<div class="slider">
  <button id="play" type="button">play</button>
  <input id="frame" type="range" min="0" max="$last" value="$last" aria-label="frame">
  <output id="time"></output>
</div>
<div class="pair frames">
  <img id="state" alt="the body"><img id="pressure" alt="contact pressure and gap">
</div>
<script>
const frames = $frames;
const [slider, play] = ["frame", "play"].map(id => document.getElementById(id));
let timer = null;
function show() {
  const frame = frames[slider.value];
  document.getElementById("time").value = frame.moment;
  for (const name of ["state", "pressure"]) {
    const image = document.getElementById(name);
    image.hidden = !frame[name];
    if (frame[name]) image.src = "data:image/png;base64," + frame[name];
  }
}
function stop() { clearInterval(timer); timer = null; play.textContent = "play"; }
slider.oninput = () => { stop(); show(); };
play.onclick = () => {
  if (timer) return stop();
  play.textContent = "stop";
  if (+slider.value === frames.length - 1) slider.value = -1;
  timer = setInterval(() => {
    slider.value = +slider.value + 1;
    show();
    if (+slider.value === frames.length - 1) stop();
  }, 250);
};
show();
</script>"""
