// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/film.h"
#include "integrator/path_observer.h"
#include "integrator/path_tracer.h"
#include "scene/scene.h"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace velatura::app {

/// Where a path met something. World space.
struct PathVertex {
    static constexpr int camera = -1;

    int from = camera;           ///< index of the vertex before
    int bounce = 0;              ///< scatterings before
    std::string prim, material;  ///< material: empty in a volume
    uint32_t face = 0;
    Vec3d p = Vec3d(0.0);
    Vec3 n = Vec3(0.0f);   ///< shading normal; zero in a volume
    float distance = 0;    ///< from the vertex before
    Rgb beta = Rgb(0.0f);  ///< throughput before the scattering there
    /// The last one there: of a path that divides, that of its last branch; nothing: it ends there.
    std::optional<integrator::PathTurn> turn;
};

/// Where a branch of a path ends.
struct PathEnd {
    int vertex = PathVertex::camera;  ///< the last one
    std::string why;
    std::optional<Vec3> escape;  ///< unit: where it goes on and meets nothing
};

/// Light that was found from a vertex, and what arrived of it.
struct PathLight {
    /// A layer of the file, and the part of the contribution that it received.
    struct Layer {
        std::string name;
        std::array<double, 3> share = {1.0, 1.0, 1.0};
    };

    int vertex = PathVertex::camera;              ///< from which it was found
    std::optional<integrator::FoundLight> found;  ///< nothing: of a volume, a caustic …
    std::string light;                            ///< prim; empty: not known
    int bounce = 0;                               ///< scatterings up to the light
    std::string group;
    std::string what;              ///< how it was found; empty: nothing of it arrived
    Rgb contribution = Rgb(0.0f);  ///< to the sample, before the pixel filter's weight and clamps
    std::vector<Layer> layers;
};

/// Everything that happened to one camera sample.
struct SamplePaths {
    uint64_t sample = 0;
    float weight = 1;             ///< of the pixel filter
    Rgb radiance = Rgb(0.0f);     ///< sum of the contributions, in their order, in double
    std::string skipped;          ///< why it is no part of the image; empty: it is
    Vec3d origin = Vec3d(0.0);    ///< world space
    Vec3 direction = Vec3(0.0f);  ///< of the camera ray
    float time = 0;               ///< of the shutter
    std::vector<PathVertex> vertices;
    std::vector<PathLight> lights;
    std::vector<PathEnd> ends;  ///< one for every branch
};

/// The light paths of one pixel.
struct PixelPaths {
    int x = 0, y = 0;
    uint64_t first = 0, end = 0;  ///< samples
    Rgb value = Rgb(0.0f);        ///< of the beauty, as the file of a render has it
    std::vector<SamplePaths> samples;
};

/// Traces samples [first, end) of a pixel, with the numbers that a render has for them.
PixelPaths trace_pixel_paths(const integrator::PathTracer& tracer,
                             const film::LayerSet& layers,
                             const integrator::World& world,
                             const PixelPaths& what);

/// What files of paths say beside the paths.
struct PathsFileInfo {
    std::string scene_name;
    double frame = 0;
    uint64_t seed = 0;
    std::string up_axis = "Y";
    double meters_per_unit = 0.01;
    double reach = 1;  ///< size of the scene: how far rays to infinity are drawn
};

/// docs/reference/paths.md.
std::string paths_as_json(const PixelPaths& paths, const PathsFileInfo& info);
std::string paths_as_usda(const PixelPaths& paths, const PathsFileInfo& info);

}  // namespace velatura::app
