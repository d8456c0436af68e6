// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/render_frame.h"
#include "base/math.h"
#include "compositor/window/layer_source.h"
#include "image/window.h"
#include "layers/light_values.h"
#include "scene/camera.h"

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace velatura::view {

/// What is seen at a pixel.
struct LivePick {
    std::array<int, 2> pixel = {0, 0};
    std::string prim, material;  ///< paths; an empty prim: nothing is there
    double depth = 0;            ///< along the view [scene units]
    Vec3d point = Vec3d(0.0);    ///< render space
    Box3d bounds;                ///< of what was hit, render space
};

/// A light that can be edited.
struct LiveLight {
    layers::LightValues values;  ///< with the edits so far
    std::string group;           ///< row of the mixer
    /// None: it is geometry, which is placed as such.
    std::optional<Mat4d> render_from_light;
    bool has_place = true;  ///< false: domes and distant lights, which only turn
};

/// What the scene offers to edits, as it was read last.
struct LiveScene {
    std::vector<LiveLight> lights;
    std::vector<app::CameraLens> cameras;
    Vec3d origin = Vec3d(0.0);  ///< of render space, in the world
};

/// Edits of the scene; only what differs from those before is set.
struct LiveEdits {
    std::optional<std::vector<std::string>> values;  ///< as options --set, in place of those before
    std::optional<std::string> camera_prim;          ///< as --camera; empty: the render's own
    std::optional<scene::Camera> camera;             ///< where it is; its lens is the scene's
    bool is_camera_reset = false;                    ///< where the scene has it
    bool is_moving = false;                          ///< more follow: drafts only
};

/// What the window asks of the render.
struct LiveRequests {
    LiveEdits edits;
    bool is_paused = false;
    std::optional<std::array<int, 2>> pick;  ///< pixel of the image
    std::optional<std::string> save_as;      ///< EXR file, with the sums; empty: the output
    bool reloads = false;                    ///< files of the scene have changed
    /// What is rendered of the image [px]; empty window: all of it.
    std::optional<image::Window> region;
    bool ends = false;
};

/// What the render does.
struct LiveStatus {
    enum class Phase : uint8_t {
        Loading,
        Building,
        Drafting,
        Learning,
        Rendering,
        Writing,
        Paused,
        Finished,
        Ended
    };

    Phase phase = Phase::Loading;
    double samples = 0;                 ///< per pixel
    std::optional<double> last_sample;  ///< per pixel; none: something else ends the render
    std::optional<double> error;        ///< relative standard error
    bool is_upper_error = false, is_lower_error = false;
    double elapsed_s = 0;  ///< since the last edit
    std::optional<double> left_s;
    double rays_per_s = 0;
    int reduction = 1;         ///< of what is shown; 1: the image itself
    double draft_s = 0;        ///< from camera to layers of the last first draft; 0: none
    int draft_reduction = 0;   ///< its
    size_t drafts = 0;         ///< first drafts so far
    double first_image_s = 0;  ///< from a scene that is ready to its first layers
    std::optional<scene::Camera> camera;        ///< of the image; none before the scene is read
    std::optional<scene::Camera> scene_camera;  ///< as the scene has it
    size_t loads = 0;                           ///< how often the scene was read
    std::shared_ptr<const LiveScene> scene;     ///< null before the scene is read
    std::shared_ptr<const std::vector<std::string>>
        problems;                         ///< errors and warnings of the last reading, with places
    std::optional<image::Window> region;  ///< that is rendered; none: the whole image
    size_t memory_bytes = 0;              ///< of the process
    Box3d bounds;                         ///< of the scene, render space
    LivePick pick;                        ///< the last one
    size_t picks = 0;                     ///< so far
    std::string message;                  ///< what happened last
    bool is_error = false;
    size_t messages = 0;  ///< so far
};

/// `64 of 256 spp · error 2.1 % · 12 s · 30 s left`.
std::string text_of(const LiveStatus& status);

/// Where the window's thread and that of the render meet.
class LiveControl {
  public:
    /// `wake` is called from the render's thread whenever there is news.
    explicit LiveControl(std::function<void()> wake) : wake_(std::move(wake)) {}

    // The window's side

    /// Changes what is asked for, and interrupts the render to look at it.
    void request(const std::function<void(LiveRequests&)>& change);
    std::optional<Result<compositor::window::RenewedLayers>> take_layers();
    LiveStatus status() const;

    // The render's side

    /// What is asked for; cameras and files once.
    LiveRequests take_requests();
    /// Until something is asked for, or a signal ends the process.
    void wait_for_request();

    /// True since request(), until take_requests().
    const std::atomic<bool>& interrupts() const { return interrupts_; }

    /// True in wait_for_request(): all that was asked for is done.
    bool is_waiting() const { return is_waiting_; }

    /// True once the end is asked for.
    const std::atomic<bool>& ends() const { return ends_; }

    void publish(Result<compositor::window::RenewedLayers> layers);
    void set_status(const std::function<void(LiveStatus&)>& change);

    void wake() const { wake_(); }

    /// What the status line says, once.
    void report(std::string message, bool is_error = false);

  private:
    std::function<void()> wake_;
    mutable std::mutex mutex_;
    std::condition_variable asked_;
    LiveRequests requests_;
    LiveStatus status_;
    std::optional<Result<compositor::window::RenewedLayers>> layers_;
    std::atomic<bool> interrupts_ = false, ends_ = false, is_waiting_ = false;
};

}  // namespace velatura::view
