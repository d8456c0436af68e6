// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/bvh.h"
#include "base/command_line.h"
#include "base/math.h"
#include "bench_shapes.h"

#include <string>
#include <vector>

namespace velatura::bench {

/// A scene with a camera and a light. Generated, the same everywhere.
struct BenchScene {
    BenchMesh direct;
    std::vector<BenchMesh> prototypes;
    std::vector<accel::SoupInstance> instances;
    std::vector<std::vector<Mat4>> later_instances = {};  ///< [instance] keys; empty: they stay
    Vec3 eye, target;
    Vec3 light, light_x, light_y;  ///< corner and edges of a rectangle light
    float ambient_distance = 1;    ///< length of ambient occlusion rays

    accel::SoupScene soup() const;
    size_t triangle_count() const;  ///< stored ones
};

/// A displaced sphere of 4·rings² − 4·rings triangles, as a scanner would give it, close by.
BenchScene make_statue(int rings);

/// How to make a scene, so that only one need be in memory.
struct SceneMaker {
    const char* name;
    BenchScene (*make)();
    bool
        is_thin;  ///< of long thin triangles off the axes, which trees without splits cannot divide
};

/// Those that ray tracers are measured on:
/// museum    24 sculptures on pedestals in a columned hall, 1.2 M triangles
/// statue    one displaced sphere as a scanner would give it, 3.1 M
/// hair      60,000 strips of 40 slivers on a head, 2.4 M
/// atrium    interior turned off the axes: walls of two triangles, columns, rods, curtains, 1.4 M
/// forest    420 trees of single leaf triangles, flattened into one mesh, 4.1 M
/// city      axis-aligned boxes, 0.9 M
/// woods     8 prototypes of trees, placed 420 times each
const std::vector<SceneMaker>& all_scenes();

/// Adds --scene, --size and --rounds.
void add_scene_options(CommandLine& line, std::vector<std::string>& scenes, int& size, int& rounds);

}  // namespace velatura::bench
