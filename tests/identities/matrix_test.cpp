// SPDX-License-Identifier: Apache-2.0
// The matrix holds in each cell what its name says. Closure cannot see light that landed in a wrong
// row or column, so every cell is compared with the beauty of other renders: only that group
// shines, and what paths of at most k scatterings bring beyond those of at most k − 1. Beauties
// know no labels.
#include "hard_case.h"
#include "image_sums.h"
#include "usd_render.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>

namespace velatura::test {

namespace {

constexpr int width = 16, height = 12;
constexpr int last_bounce = 3;  ///< of render_scene

/// A light that is seldom asked brings much when it is: rare bright samples, by which less could be
/// told.
constexpr auto usual_selection = lights::SelectionKind::Uniform;

film::Film render(const scene::Scene& scene,
                  uint64_t samples,
                  uint64_t seed,
                  int max_depth = 0,
                  lights::SelectionKind selection = usual_selection) {
    integrator::RenderOptions options;
    options.end_sample = samples;
    options.seed = seed;
    options.max_depth = max_depth;
    return render_scene(
        scene, options,
        RenderSetup{.light_selection = selection, .sampler = sampling::SamplerKind::SobolHalves});
}

ImageLight beauty_of(const scene::Scene& scene,
                     uint64_t samples,
                     uint64_t seed,
                     int max_depth = 0) {
    return light_of(render(scene, samples, seed, max_depth), accumulate::AccumulatorTable::beauty);
}

/// Nothing but the group gives light.
scene::Scene only(scene::Scene scene, scene::GroupId group) {
    for (scene::Light& l : scene.lights)
        if (l.group != group) l.Le = Rgb(0.0f);
    if (group == scene.emissive_group()) return scene;
    for (scene::Material& m : scene.materials) m.emissive_color = scene::Input(Rgb(0.0f));
    for (scene::Volume& v : scene.volumes) v.emission = scene::none;
    return scene;
}

/// Nothing scatters.
scene::Scene without_scattering(scene::Scene scene) {
    for (scene::Material& m : scene.materials) {
        const scene::Input emission = m.emissive_color;
        m = {};
        m.diffuse_color = scene::Input(Rgb(0.0f));
        m.emissive_color = emission;
        m.has_specular = false;
    }
    const auto blacken = [&](scene::Shape& shape) {
        if (shape.material == scene::none)
            shape.material = scene::MaterialId(scene.materials.size());
    };
    for (scene::Shape& shape : scene.shapes) blacken(shape);
    scene::Material black;
    black.diffuse_color = scene::Input(Rgb(0.0f));
    black.has_specular = false;
    scene.materials.push_back(black);
    for (scene::Volume& v : scene.volumes) v.optics.albedo = Rgb(0.0f);
    return scene;
}

struct Cells {
    std::vector<std::string> names;  ///< [column · groups + group]
    std::vector<ImageLight> light;
    size_t groups = 0;
};

Cells matrix_of(const scene::Scene& scene,
                uint64_t samples,
                lights::SelectionKind selection = usual_selection) {
    const film::Film film = render(scene, samples, 1, 0, selection);
    Cells cells;
    cells.groups = scene.groups.size();
    for (int column = 0; column <= last_bounce + 1; ++column) {
        for (size_t g = 0; g < cells.groups; ++g) {
            cells.names.push_back(film.layer_set().column_name(column) + "_" +
                                  scene.groups[g].name);
            cells.light.push_back(light_of(film, film.sums().table().matrix(column, int(g))));
        }
    }
    return cells;
}

Cells by_brute_force(const scene::Scene& scene, uint64_t samples) {
    Cells cells;
    cells.groups = scene.groups.size();
    cells.light.resize(cells.groups * (last_bounce + 2));
    for (size_t g = 0; g < cells.groups; ++g) {
        const scene::Scene lit = only(scene, scene::GroupId(g));
        const uint64_t seed = 100 + g;
        const ImageLight seen = beauty_of(without_scattering(lit), samples, seed + 1000);
        cells.light[g] = seen;
        // One scattering at most, less what is seen directly: the same renders of other samples
        // would add noise
        std::vector<ImageLight> up_to{seen};
        for (int depth = 1; depth <= last_bounce; ++depth)
            up_to.push_back(beauty_of(lit, samples, seed, depth));
        up_to.push_back(beauty_of(lit, samples, seed));
        for (size_t column = 1; column < up_to.size(); ++column)
            cells.light[column * cells.groups + g] = up_to[column] - up_to[column - 1];
    }
    return cells;
}

/// 25 cells or so at 3 standard errors: 0.07 exceed it in the mean, two do with probability 0.002.
constexpr int max_beyond_three = 1;
/// χ² of 4 over 4: 3.9 is exceeded with probability 0.0037 by noise that is normal; that of cells
/// with rare bright paths is not quite.
constexpr double largest_mean_square = 5.0;

void expect_cells_by_brute_force(const scene::Scene& scene, const char* what, uint64_t samples) {
    const Cells matrix = matrix_of(scene, samples), brute = by_brute_force(scene, samples);
    int beyond = 0, lit = 0, told_apart = 0, pairs = 0;
    double worst = 0, worst_square = 0, min = 1e30, max = 0;
    for (size_t i = 0; i < matrix.light.size(); ++i) {
        const ImageLight difference = matrix.light[i] - brute.light[i];
        const PixelSum sum = whole(difference), cell = whole(brute.light[i]);
        const double z = distance(difference), square = mean_square_of_quarters(difference);
        EXPECT_LT(z, 4.0) << matrix.names[i] << ": " << cell.value << " by brute force, "
                          << whole(matrix.light[i]).value;
        EXPECT_LT(square, largest_mean_square) << matrix.names[i];
        beyond += z > 3.0;
        worst = hardcase::larger(worst, z);
        worst_square = hardcase::larger(worst_square, square);
        if (cell.value == 0) continue;
        ++lit;
        const double detectable = (3.0 + 1.2816) * std::sqrt(sum.variance) / cell.value;
        min = std::min(min, detectable);
        max = hardcase::larger(max, detectable);
        // In a neighbor's place it would be noticed
        const size_t right = i % matrix.groups + 1 < matrix.groups ? i + 1 : i - 1;
        for (const size_t wrong : {right, i + matrix.groups}) {
            if (wrong >= matrix.light.size()) continue;
            ++pairs;
            told_apart += distance(matrix.light[i] - brute.light[wrong]) > 3.0;
        }
    }
    EXPECT_LE(beyond, max_beyond_three);
    hardcase::expect_in_hard_case(
        {std::string(what) + ": worst deviate of a cell", worst, 4, 0,
         "renders of that light and that depth alone",
         fmt::format("{:.1f} to {:.0f} % of a cell", 100 * min, 100 * max)});
    EXPECT_GE(told_apart, pairs * 4 / 5);
    std::printf(
        "%s: %d cells with light, worst |z| %.2f, worst mean square %.2f; 90 %% power from %.2f to "
        "%.2f %% of a cell; %d of %d "
        "neighbors distinguished\n",
        what, lit, worst, worst_square, 100 * min, 100 * max, told_apart, pairs);
}

/// Two of the lights share a row.
std::string grouped_room() {
    std::string text = soft_room();
    for (const char* light : {"def RectLight", "def DistantLight"}) {
        const size_t begin = text.find(light);
        text.insert(text.find('{', begin) + 1, "\nstring velatura:light:group = \"day\"\n");
    }
    return text;
}

std::string smoky_room() {
    std::string text = soft_room();
    text.insert(text.rfind('}'), R"usda(
    def Volume "Smoke"
    {
        rel field:density = </Root/Smoke/D>
        color3f velatura:volume:albedo = (0.5, 0.7, 0.9)
        float velatura:volume:densityScale = 0.5
        double3 xformOp:translate = (-1, 0.25, 0.5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def OpenVDBAsset "D"
        {
            token fieldName = "waves"
        }
    }
)usda");
    return text;
}

}  // namespace

TEST(H51Matrix, EveryCellIsItsLightAtItsDepth) {
    expect_cells_by_brute_force(scene_from_usda(soft_room(), width, height), "room", 384);
}

TEST(Matrix, EveryCellOfARoomWithSmokeIsItsLightAtItsDepth) {
    expect_cells_by_brute_force(scene_from_usda(smoky_room(), width, height), "room with smoke",
                                256);
}

TEST(Matrix, RowsOfSeveralLightsAreTheirSum) {
    expect_cells_by_brute_force(scene_from_usda(grouped_room(), width, height),
                                "room with a shared row", 256);
}

// What a light gives is no matter of chance but where it decides which light is asked: chosen
// uniformly, a light of another intensity takes the same paths, and all that they bring is
// multiplied. Doubling changes exponents alone.
TEST(Gains, CommuteWithRendering) {
    const scene::Scene scene = scene_from_usda(room_usda(), width, height);
    // Neither the choice of lights nor trial paths depend on how strong they are
    const RenderSetup setup{.light_selection = lights::SelectionKind::Uniform,
                            .roulette = integrator::Roulette::Throughput};
    integrator::RenderOptions options;
    options.end_sample = 16;
    const film::Film before = render_scene(scene, options, setup);
    const accumulate::AccumulatorTable& table = before.sums().table();
    const auto for_each_sum = [&](const film::Film& film, const auto& visit) {
        for (int y = 0; y < height; ++y) {
            for (int x = 0; x < width; ++x) {
                for (int g = 0; g < before.layer_set().group_count(); ++g) {
                    for (int c = 0; c <= last_bounce + 2; ++c) {
                        const uint32_t a =
                            c <= last_bounce + 1 ? table.matrix(c, g) : table.unoccluded(g);
                        const accumulate::Triple p = before.sums().total(x, y, a),
                                                 q = film.sums().total(x, y, a);
                        visit(g, p.x, q.x);
                        visit(g, p.y, q.y);
                        visit(g, p.z, q.z);
                    }
                }
            }
        }
    };
    for (const float gain : {2.0f, 0.125f, 1.7f}) {
        for (size_t row = 0; row < scene.lights.size(); ++row) {
            scene::Scene changed = scene;
            changed.lights[row].Le *= gain;
            const auto group = int(scene.lights[row].group);
            double worst = 0;
            for_each_sum(render_scene(changed, options, setup), [&](int g, double p, double q) {
                const double expected = g == group ? double(gain) * p : p;
                if (g != group || gain != 1.7f) {
                    ASSERT_EQ(std::bit_cast<uint64_t>(q), std::bit_cast<uint64_t>(expected))
                        << scene.lights[row].name << " times " << gain;
                } else if (p != 0) {
                    worst = hardcase::larger(worst, std::abs(q / expected - 1));
                }
            });
            // A few roundings to float per deposit, all of one sign
            EXPECT_LT(worst, 8 * 0x1p-24);
            if (gain == 1.7f)
                std::printf("%s times %g: within %.2g\n", scene.lights[row].name.c_str(),
                            double(gain), worst);
        }
    }
}

// A light tree chooses by power: after one light's change all paths are others, and only the mean
// is the same
TEST(Gains, CommuteInTheMeanWhereLightsAreChosenByPower) {
    const scene::Scene scene = scene_from_usda(soft_room(), width, height);
    scene::Scene changed = scene;
    changed.lights[0].Le *= 4.0f;
    const auto by_power = lights::SelectionKind::Tree;
    const Cells one = matrix_of(scene, 128, by_power), other = matrix_of(changed, 128, by_power);
    double worst = 0;
    for (size_t i = 0; i < one.light.size(); ++i) {
        ImageLight expected = one.light[i];
        if (i % one.groups == scene.lights[0].group) {
            expected = expected.plus(expected, 3.0);
        }
        worst = hardcase::larger(worst, distance(other.light[i] - expected));
    }
    std::printf("worst |z| of %zu cells %.2f\n", one.light.size(), worst);
    EXPECT_LT(worst, 4.0);
}

}  // namespace velatura::test
