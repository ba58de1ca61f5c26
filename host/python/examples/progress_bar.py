#!/usr/bin/env python3
"""A render with a progress bar. Ctrl-C ends it; what is done by then goes on from its checkpoint at the next start."""

import pathlib
import sys

import castor

SCENE = pathlib.Path(__file__).resolve().parents[3] / "scenes/knot.xml"


def main() -> None:
    output = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "progress_bar.png")
    checkpoint = output.with_suffix(".checkpoint")
    scene = castor.Scene.load(SCENE, progress=True)
    renderer = castor.Renderer(scene, progress=True)
    camera = scene.cameras[0].resized(208, 117)
    film = renderer.render(camera, samples_per_pixel=16, progress=True, checkpoint=checkpoint,
                           resume=checkpoint if checkpoint.exists() else None)
    film.save(output)
    checkpoint.unlink(missing_ok=True)
    print(film, f"of {renderer.statistics['rays']} rays in {renderer.statistics['render_seconds']:.2f} s")


if __name__ == "__main__":
    main()
