// SPDX-License-Identifier: Apache-2.0
#include "selftest/image_checks.h"

#include "base/tasks.h"
#include "film/film.h"
#include "layers/resolve.h"
#include "lights/light_set.h"
#include "render/renderer.h"
#include "sampling/sampler.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>
#include <vector>

namespace velatura::selftest {

namespace {

scene::MaterialId add_matte(scene::Scene& scene,
                            const Rgb& albedo,
                            const Rgb& emission = Rgb(0.0f)) {
    scene::Material material;
    material.has_specular = false;
    material.diffuse_color = scene::Input(albedo);
    material.emissive_color = scene::Input(emission);
    scene.materials.push_back(material);
    return scene::MaterialId(scene.materials.size() - 1);
}

/// Closed box around the origin, faces outward.
void add_box(scene::Scene& scene, float half, scene::MaterialId material) {
    scene::Mesh mesh;
    for (int i = 0; i < 8; ++i)
        mesh.points.emplace_back(i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half);
    mesh.face_vertex_counts = {4, 4, 4, 4, 4, 4};
    mesh.face_vertex_indices = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4,
                                2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
    scene.shapes.emplace_back();
    scene.shapes.back().geometry = mesh;
    scene.shapes.back().material = material;
}

void add_ball(scene::Scene& scene,
              const Vec3d& center,
              double radius,
              const scene::Material& material) {
    scene::Gprim ball;
    ball.kind = scene::Gprim::Kind::Sphere;
    ball.radius = radius;
    ball.shape_from_gprim.setTranslation(center);
    scene.materials.push_back(material);
    scene.shapes.emplace_back();
    scene.shapes.back().geometry = ball;
    scene.shapes.back().material = scene::MaterialId(scene.materials.size() - 1);
}

/// Camera at the origin, looking along −z.
void look(scene::Scene& scene) {
    scene.camera.window_left = scene.camera.window_bottom = -0.5;
    scene.camera.window_right = scene.camera.window_top = 0.5;
    scene.camera.clip_near = 0;
}

/// A gray box with a ball of glass, one of brushed metal, and two lamps, all of it `s` times as
/// large.
scene::Scene room(double s) {
    scene::Scene scene;
    scene.groups = {{"key", {"/Key"}, false}, {"lamp", {"/Lamp"}, false}, {"emissive", {}, false}};
    add_box(scene, float(2.0 * s), add_matte(scene, Rgb(0.7f, 0.5f, 0.3f)));
    scene::Material glass, metal;
    glass.diffuse_color = scene::Input(Rgb(0.0f));
    glass.opacity = glass.roughness = scene::Input(0.0f);
    metal.metallic = scene::Input(1.0f);
    metal.roughness = scene::Input(0.4f);
    metal.diffuse_color = scene::Input(Rgb(0.9f, 0.8f, 0.6f));
    add_ball(scene, Vec3d(-0.5, -0.3, -1.25) * s, 0.375 * s, glass);
    add_ball(scene, Vec3d(0.4, 0.2, -1.5) * s, 0.5 * s, metal);
    Mat4d scale;
    scale.setScale(s);
    for (const auto kind : {scene::LightKind::Rect, scene::LightKind::Sphere}) {
        scene::Light light;
        light.kind = kind;
        light.name = kind == scene::LightKind::Rect ? "/Key" : "/Lamp";
        light.group = kind == scene::LightKind::Rect ? 0 : 1;
        light.radius = 0.25f;
        light.Le = Rgb(8.0f);
        Mat4d place;
        place.setTranslation(kind == scene::LightKind::Rect ? Vec3d(0.25, 0.5, 1.75)
                                                            : Vec3d(-1.25, 1.0, -0.5));
        light.render_from_light = place * scale;
        scene.lights.push_back(light);
    }
    look(scene);
    return scene;
}

struct RenderOptions {
    int size = 24;
    uint64_t samples = 8;
    int max_depth = 0;
    bool by_paths_alone = false;  ///< without light sampling and roulette
    int tile = 16;
};

film::Film render(const scene::Scene& scene, const RenderOptions& options) {
    render::Settings settings;
    settings.world.width = settings.world.height = options.size;
    settings.layers.last_bounce = 4;
    settings.layers.matrix_layers = true;
    settings.layers = render::with_rows(std::move(settings.layers), scene);
    settings.guiding = integrator::Guiding::Off;
    settings.splits = false;
    settings.schedule.mode = integrator::RenderMode::Tile;
    settings.schedule.tile_size = options.tile;
    settings.schedule.end_sample = options.samples;
    settings.tracer.max_depth = options.max_depth;
    if (options.by_paths_alone) {
        settings.tracer.estimator.light_sampling = integrator::LightSampling::Bsdf;
        settings.tracer.estimator.roulette = integrator::Roulette::None;
    }
    Diagnostics diagnostics;
    render::Renderer renderer(scene, std::move(settings));
    renderer.prepare(diagnostics);
    renderer.advance();
    return renderer.take_film();
}

/// Every sum of every pixel.
std::vector<uint64_t> bits_of(const film::Film& film) {
    std::vector<uint64_t> bits;
    for (int y = film.window().y0; y < film.window().y1; ++y) {
        for (int x = film.window().x0; x < film.window().x1; ++x) {
            for (uint32_t a = 0; a < film.sums().table().total_count(); ++a) {
                const accumulate::Triple t = film.sums().total(x, y, a);
                for (const double v : {t.x, t.y, t.z})
                    bits.push_back(std::bit_cast<uint64_t>(v + 0.0));
            }
        }
    }
    return bits;
}

/// The sums of a pixel that light is made of: geometry has the unit of the scene.
std::vector<uint64_t> light_bits_of(const film::Film& film) {
    std::vector<uint64_t> bits;
    for (int y = film.window().y0; y < film.window().y1; ++y) {
        for (int x = film.window().x0; x < film.window().x1; ++x) {
            const accumulate::Triple t =
                film.sums().total(x, y, accumulate::AccumulatorTable::beauty);
            for (const double v : {t.x, t.y, t.z}) bits.push_back(std::bit_cast<uint64_t>(v));
        }
    }
    return bits;
}

double count_different(const std::vector<uint64_t>& a, const std::vector<uint64_t>& b) {
    size_t count = a.size() == b.size() ? 0 : std::max(a.size(), b.size());
    for (size_t i = 0; count == 0 && i < a.size(); ++i) count += a[i] != b[i];
    return double(count);
}

}  // namespace

Finding scaled_image(uint64_t amount) {
    const RenderOptions options{.samples = 4 * amount};
    const std::vector<uint64_t> unscaled = light_bits_of(render(room(1.0), options));
    double different = 0;
    for (const int k : {-20, -7, 10, 20})
        different +=
            count_different(light_bits_of(render(room(std::ldexp(1.0, k)), options)), unscaled);
    return {"images of a room scaled by 2^-20, 2^-7, 2^10 and 2^20 that differ in a bit", different,
            0};
}

Finding sphere_lamps(uint64_t amount) {
    // Irradiance π r² at distance 1, facing the lamp
    double worst = 0, detectable = 0;
    for (const double radius : {0.999, 0.5, 1e-2, 1e-4, 1e-7}) {
        scene::Scene scene;
        scene.groups.resize(2);
        scene::Light light;
        light.kind = scene::LightKind::Sphere;
        light.name = "/Lamp";
        light.radius = float(radius);
        light.render_from_light.setTranslation(Vec3d(0, 0, 1));
        scene.lights = {light};
        Diagnostics diagnostics;
        const lights::LightSet lights(scene, {}, diagnostics);
        constexpr int sets = 16;
        const uint64_t samples = 4096 * amount;
        double sum = 0, squares = 0;
        for (int set = 0; set < sets; ++set) {
            double irradiance = 0;
            for (uint64_t i = 0; i < samples; ++i) {
                const auto s = lights.sample(0, Vec3(0.0f),
                                             sampling::PixelSampler(7, set, 3, i)
                                                 .get_2d(0, sampling::Purpose::LightSurface));
                if (s)
                    irradiance += double(s->Le.x) * std::max(0.0, double(s->wi.z)) / double(s->pdf);
            }
            const double relative =
                irradiance / double(samples) / (pi_d * double(light.radius) * double(light.radius));
            sum += relative;
            squares += relative * relative;
        }
        const double mean = sum / sets,
                     error = std::sqrt(std::max(0.0, squares / sets - mean * mean) / (sets - 1));
        worst = std::isnan(mean) ? mean : std::max(worst, std::abs(mean - 1));
        detectable = std::max(detectable, 5.2816 * error);
    }
    return {"irradiance from spheres of radius 0.999 to 1e-7 at distance 1, relative", worst, 2e-4,
            detectable};
}

Finding furnace(uint64_t amount) {
    // In a closed room of albedo 1/2 that glows with 1/2 each bounce brings half of what the last
    // one brought, on every path
    scene::Scene scene;
    scene.groups = {{"emissive", {}, false}};
    add_box(scene, 1.0f, add_matte(scene, Rgb(0.5f), Rgb(0.5f)));
    look(scene);
    const film::Film film =
        render(scene, {.size = 8, .samples = 16 * amount, .max_depth = 20, .by_paths_alone = true});
    double worst = 0;
    for (int bounce = 0; bounce <= 4; ++bounce) {
        for (int y = 0; y < 8; ++y) {
            for (int x = 0; x < 8; ++x) {
                const double mean =
                    film.sums().total(x, y, film.sums().table().matrix(bounce, 0)).x /
                    double(16 * amount);
                const double deviation = std::abs(mean / std::ldexp(0.5, -bounce) - 1);
                worst = std::isnan(deviation) ? deviation : std::max(worst, deviation);
            }
        }
    }
    return {"light of the first 5 bounces in every pixel, relative", worst, 1e-6};
}

Finding layers(uint64_t amount) {
    const film::Film film = render(room(1.0), {.samples = 4 * amount});
    const layers::ResolvedLayers resolved = layers::resolve_layers(film.sums());
    uint64_t different = !resolved.first_failure.empty() || resolved.closure.empty();
    if (different == 0) {
        for (const char* channel : {"R", "G", "B"}) {
            for (size_t i = 0; i < film.window().pixel_count(); ++i) {
                float sum = 0.0f;
                for (const std::string& layer : resolved.closure[0].order)
                    sum += resolved.image.find(layer + "." + channel)->value(i);
                different += std::bit_cast<uint32_t>(sum) !=
                             std::bit_cast<uint32_t>(resolved.image.find(channel)->value(i));
            }
        }
    }
    return {"values of the beauty that differ from the sum of its layers", double(different), 0};
}

Finding threads(uint64_t amount) {
    const scene::Scene scene = room(1.0);
    const auto image = [&](int count, int tile) {
        const ThreadLimit limit(count);
        return bits_of(render(scene, {.samples = 4 * amount, .tile = tile}));
    };
    const std::vector<uint64_t> alone = image(1, 16);
    double different = 0;
    for (const auto& [count, tile] : {std::pair{2, 8}, {3, 33}, {7, 16}, {0, 64}})
        different += count_different(image(count, tile), alone);
    return {"images by 2, 3, 7 and all threads, tiles of 8 to 64, that differ in a bit", different,
            0};
}

}  // namespace velatura::selftest
