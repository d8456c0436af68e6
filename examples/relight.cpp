// SPDX-License-Identifier: Apache-2.0
// Renders a scene, moves the camera, dims the first light, renders again.
// Usage: velatura_example_relight SCENE.usda FIRST.exr SECOND.exr
#include "render/load_scene.h"
#include "render/renderer.h"

#include <fmt/format.h>

#include <chrono>

using namespace velatura;

int main(int argc, char** argv) {
    if (argc != 4) return 2;
    Diagnostics diagnostics;
    diagnostics.set_listener(
        [&](const Diagnostic& d) { fmt::print(stderr, "{}\n", diagnostics.format(d)); });
    Result<scene::Scene> scene = render::load_scene(argv[1], {}, diagnostics);
    if (!scene) return fmt::print(stderr, "{}\n", scene.error().message), 1;

    render::Settings settings;
    settings.layers = render::with_rows({}, *scene);
    settings.schedule.end_sample = 4;
    settings.guiding = integrator::Guiding::Off;
    render::Renderer renderer(std::move(*scene), settings);
    for (int image : {2, 3}) {
        const auto start = std::chrono::steady_clock::now();
        renderer.prepare(diagnostics);
        const auto ready = std::chrono::steady_clock::now();
        renderer.advance();
        const std::chrono::duration<double> preparing = ready - start;
        fmt::print("{}: ready after {:.3f} s, {:.3f} s\n", argv[image], preparing.count(),
                   (std::chrono::steady_clock::now() - start).count() * 1e-9);
        if (const auto written = renderer.write(argv[image]); !written)
            return fmt::print(stderr, "{}\n", written.error().message), 1;

        scene::Camera camera = renderer.scene().camera;
        camera.render_from_camera[3][0] += 0.1 * camera.focus_distance;
        renderer.set_camera(camera);
        if (renderer.scene().lights.empty()) continue;
        scene::Light light = renderer.scene().lights[0];
        light.Le *= 0.25f;
        renderer.set_light(0, light);
    }
}
