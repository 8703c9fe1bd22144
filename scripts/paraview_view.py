"""Opens a run in ParaView as the paper shows it:

    paraview --script=open_in_paraview.py

The left view shows the deformed body, coloured by its damage 1 - zeta, over the initial outline, and (hidden)
the most damaged region. The right view shows the von Mises stress and the contact pressure. The time slider
selects a frame. `pvbatch open_in_paraview.py PICTURE` saves a picture.
"""

import os
import sys

from paraview import simple
from paraview.simple import SetProperties as setup

# Values that `signorini plot --paraview` found in the run.
RUN = {}

# pvbatch knows the path of the script, ParaView's window does not.
FOLDER = os.path.dirname(os.path.abspath(__file__)) if "__file__" in globals() else RUN["folder"]


def coloured(shown, view, field, name, preset, least, largest):
    """Colours a representation by a field between two values, with a colour bar."""
    simple.ColorBy(shown, field)
    colours = simple.GetColorTransferFunction(field[1])
    colours.ApplyPreset(preset, True)
    colours.RescaleTransferFunction(least, largest)
    colours.AutomaticRescaleRangeMode = "Never"
    bar = simple.GetScalarBar(colours, view)
    setup(bar, Title=name, ComponentTitle="", TitleColor=[0, 0, 0], LabelColor=[0, 0, 0], RangeLabelFormat="%.3g")
    shown.SetScalarBarVisibility(view, True)
    # This draws the sides of quadratic triangles as curves.
    setup(shown, NonlinearSubdivisionLevel=2, Ambient=1.0, Diffuse=0.0)


def view_of_deformation(fields, view):
    """The body warped by u, its damage, and its initial outline."""
    damage = simple.Calculator(registrationName="damage", Input=fields)
    setup(damage, ResultArrayName="damage", Function="1 - zeta")
    body = simple.WarpByVector(registrationName="deformed body", Input=damage)
    setup(body, Vectors=["POINTS", "displacement"], ScaleFactor=RUN["factor"])
    shown = simple.Show(body, view)
    shown.Representation = "Surface With Edges"
    shown.EdgeColor = [0.4, 0.4, 0.4]
    coloured(shown, view, ("POINTS", "damage"), "1 - zeta", "Magma (matplotlib)", 0.0, RUN["damage"] or 1.0)
    outline = simple.Show(fields, view)
    setup(outline, Representation="Feature Edges", LineWidth=1.5, ColorArrayName=["POINTS", ""],
          AmbientColor=[0, 0, 0], DiffuseColor=[0, 0, 0])
    most = simple.Threshold(registrationName="damaged most", Input=body)
    setup(most, Scalars=["POINTS", "damage"], ThresholdMethod="Above Upper Threshold",
          UpperThreshold=0.5 * RUN["damage"])
    simple.Hide(most, view)
    return f"deformed body, displacements x {RUN['factor']:g}"


def view_of_stress(fields, contact, view):
    """The von Mises stress on the initial configuration, and arrows for the contact pressure."""
    shown = simple.Show(fields, view)
    coloured(shown, view, ("POINTS", "von_mises"), f"von Mises stress ({RUN['stress_unit']})",
             "Viridis (matplotlib)", 0.0, RUN["stress"] or 1.0)
    if contact is None or not RUN["pressure"]:
        return "von Mises stress"
    arrows = simple.Glyph(registrationName="contact pressure", Input=contact, GlyphType="Arrow")
    setup(arrows, OrientationArray=["POINTS", "pressure_on_body"], ScaleArray=["POINTS", "normal_pressure"],
          GlyphMode="All Points", ScaleFactor=0.12 * RUN["size"] / RUN["pressure"])
    # Thin arrows with their tips on the body.
    setup(arrows.GlyphType, TipRadius=0.03, TipLength=0.15, ShaftRadius=0.008)
    setup(arrows.GlyphTransform, Translate=[-1, 0, 0])
    arrows = simple.Show(arrows, view)
    setup(arrows, ColorArrayName=["POINTS", ""], AmbientColor=[0.75, 0.2, 0.15], DiffuseColor=[0.75, 0.2, 0.15])
    return "von Mises stress, contact pressure"


def read(name):
    """The frames in a list of the folder; None without the list."""
    path = os.path.join(FOLDER, name)
    return simple.PVDReader(registrationName=name, FileName=path) if os.path.exists(path) else None


def main():
    """Builds both views and shows the last frame or the given one."""
    if not os.path.exists(os.path.join(FOLDER, "fields.pvd")):
        raise RuntimeError(f"no fields.pvd in {FOLDER}: after moving results, repeat " "`signorini plot --paraview`")
    simple.RemoveViewsAndLayouts()
    fields, contact = read("fields.pvd"), read("contact.pvd")
    left, right = (simple.CreateView("RenderView") for _ in range(2))
    layout = simple.CreateLayout(name=RUN["title"])
    layout.AssignView(layout.SplitHorizontal(0, 0.5), left)
    layout.AssignView(2, right)
    layout.SetSize(1600, 800)
    scene = simple.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.AnimationTime = RUN["time"]
    titles = view_of_deformation(fields, left), view_of_stress(fields, contact, right)
    for view, title in zip((left, right), titles):
        setup(view, UseColorPaletteForBackground=False, Background=[1, 1, 1], InteractionMode="2D",
                 OrientationAxesVisibility=False)
        time = simple.AnnotateTimeFilter(Input=fields, Format=title + ", t = {time:g} " + RUN["time_unit"])
        time = simple.Show(time, view)
        setup(time, Color=[0, 0, 0], WindowLocation="Upper Center")
        simple.ResetCamera(view)
        simple.Render(view)
    simple.AddCameraLink(left, right, "both views")
    if len(sys.argv) > 1:
        simple.SaveScreenshot(sys.argv[1], layout, ImageResolution=[1600, 800])


main()
