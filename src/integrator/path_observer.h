// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "film/path_event.h"
#include "geometry/surface_point.h"
#include "guiding/guiding_field.h"
#include "lights/light_sample.h"
#include "scene/ids.h"

#include <limits>
#include <optional>

namespace velatura::integrator {

/// Light that a path finds, by sampling it or by meeting it.
struct FoundLight {
    std::optional<lights::LightId> light;  ///< nothing: a surface that is not sampled
    Vec3 from, d;                          ///< the ray to it, d unit
    float distance = std::numeric_limits<float>::infinity();  ///< infinite at infinity
    float light_pdf = 0;  ///< [1/sr] of light sampling, its choice included; 0: it does not compete
    float scatter_pdf = 0;     ///< [1/sr] of going on that way; 0: it does not compete
    float weight = 1;          ///< of MIS, in [0, 1]
    Rgb radiance = Rgb(0.0f);  ///< what is deposited if nothing stands in the way
};

/// How a path goes on from where it is.
struct PathTurn {
    Vec3 wi;                   ///< unit
    film::EventShares events;  ///< shares of the lobes; none where the path goes straight on
    float pdf = 0;             ///< [1/sr]; of a delta lobe its probability
    bool is_delta = false;
};

/// Looks at one path while it is traced, for `--replay`. Called in the order of events.
class PathObserver {
  public:
    virtual ~PathObserver() = default;

    /// The path leaves the camera.
    virtual void on_camera(const geometry::Ray& ray) { (void)ray; }

    virtual void on_hit(int bounce,
                        const geometry::SurfacePoint& point,
                        float t,
                        const Rgb& beta) = 0;

    /// The path collides in a volume at p, a distance t on; beta before it does.
    virtual void on_volume(int bounce, const Vec3& p, float t, const Rgb& beta) {
        (void)bounce, (void)p, (void)t, (void)beta;
    }

    virtual void on_deposit(int bounce,
                            scene::GroupId group,
                            const Rgb& radiance,
                            const char* what) = 0;

    /// Light was found; the next deposit, if it comes before any other call and is of light
    /// sampled, light hit by the path or surface emission, is what arrives of it.
    virtual void on_light(const FoundLight& found) { (void)found; }

    /// The path goes on from the last vertex; bounce: scatterings before.
    virtual void on_turn(int bounce, const PathTurn& turn) { (void)bounce, (void)turn; }

    /// The path divides at the last vertex: what follows an on_end() goes on from there.
    virtual void on_split() {}

    /// Clamps leave the next deposit as it is.
    virtual void on_unlimited() {}

    /// The path may scatter at `at` by lobes that are no delta; beta before it does. Lights sampled
    /// there came before.
    virtual void on_vertex(const guiding::GuidingPoint& at, const Rgb& beta) {
        (void)at, (void)beta;
    }

    /// The same, called after it, of a vertex whose caustics light tracing leaves to the path: it
    /// came from the camera by a narrow lobe first.
    virtual void on_hidden_receiver(const geometry::SurfacePoint& point,
                                    const Vec3& wo,
                                    const Rgb& beta) {
        (void)point, (void)wo, (void)beta;
    }

    /// It did, and goes on along wi. Not called for delta lobes.
    virtual void on_scatter(const Vec3& wi) { (void)wi; }

    /// The path outlived a chance to end, of a roulette that has gains; carried: of what it began
    /// with, largest channel.
    virtual void on_survival(int bounce, float carried) { (void)bounce, (void)carried; }

    virtual void on_end(int bounce, const char* why) = 0;
};

}  // namespace velatura::integrator
