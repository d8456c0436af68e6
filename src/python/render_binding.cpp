// SPDX-License-Identifier: Apache-2.0
#include "python/bindings.h"
#include "python/conversions.h"
#include "python/scene_builder.h"
#include "python/session.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

namespace py = pybind11;

namespace velatura::python {

namespace {

/// How far a render is.
struct Progress {
    double fraction = 0, spp = 0, elapsed = 0;
    std::optional<double> left, error;
};

/// A render in a thread of its own, so that the calling thread can run Python code meanwhile: the
/// progress function and handlers of signals.
class RenderThread {
  public:
    explicit RenderThread(Session& session)
        : thread_([this, &session] {
              try {
                  frame_ = session.render([this](const integrator::RenderState& s) { keep(s); });
              } catch (...) {
                  thrown_ = std::current_exception();
              }
              const std::lock_guard lock(mutex_);
              is_done_ = true;
              changed_.notify_all();
          }) {}

    ~RenderThread() {
        if (thread_.joinable()) thread_.join();
    }

    RenderThread(const RenderThread&) = delete;
    RenderThread& operator=(const RenderThread&) = delete;

    /// Waits for the end, or for a while. Returns: whether it has ended.
    bool wait(std::chrono::milliseconds time) {
        std::unique_lock lock(mutex_);
        return changed_.wait_for(lock, time, [this] { return is_done_; });
    }

    /// What came since the last call.
    std::optional<Progress> take_progress() {
        const std::lock_guard lock(mutex_);
        return std::exchange(latest_, std::nullopt);
    }

    /// After the end. Throws what render() threw.
    std::shared_ptr<Frame> frame() {
        thread_.join();
        if (thrown_) std::rethrow_exception(thrown_);
        return frame_;
    }

  private:
    void keep(const integrator::RenderState& s) {
        const std::lock_guard lock(mutex_);
        latest_ = Progress{s.fraction, s.samples_per_pixel, s.elapsed_s, s.left_s, s.error};
    }

    std::mutex mutex_;
    std::condition_variable changed_;
    bool is_done_ = false;
    std::optional<Progress> latest_;
    std::shared_ptr<Frame> frame_;
    std::exception_ptr thrown_;
    std::thread thread_;
};

/// Calls `progress`, which ends the render by False; runs handlers of signals.
void run_python(const py::object& progress, RenderThread& thread, Session& session) {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    const std::optional<Progress> state = thread.take_progress();
    if (!state || progress.is_none()) return;
    const py::object answer = progress(*state);
    if (py::isinstance<py::bool_>(answer) && !answer.cast<bool>()) session.cancel();
}

std::shared_ptr<Frame> render(const std::shared_ptr<Session>& session, const py::object& progress) {
    constexpr std::chrono::milliseconds pause(20);
    RenderThread thread(*session);
    for (;;) {
        bool is_done = false;
        {
            const py::gil_scoped_release release;
            is_done = thread.wait(pause);
        }
        if (is_done) break;
        try {
            run_python(progress, thread, *session);
        } catch (...) {
            // The exception of Python code is the one to see, whatever the render says then
            session->cancel();
            const py::gil_scoped_release release;
            while (!thread.wait(pause)) session->cancel();
            throw;
        }
    }
    return thread.frame();
}

std::shared_ptr<Session> open(const py::object& scene, const py::kwargs& options) {
    std::shared_ptr<usd::layer::Layer> layer;
    if (py::isinstance<SceneBuilder>(scene)) layer = scene.cast<SceneBuilder&>().layer.layer();
    const std::string name = layer ? layer->identifier() : path_of(scene);
    const app::RenderArguments arguments = render_arguments(name, keywords_of(options));
    const py::gil_scoped_release release;
    return Session::open(arguments, std::move(layer));
}

py::dict effects_and_needs(Session& session) {
    std::string text;
    {
        const py::gil_scoped_release release;
        text = session.plan_json();
    }
    return from_json(text);
}

std::vector<std::string> write(Frame& frame, const py::object& path) {
    const std::string name = path_of(path);
    const py::gil_scoped_release release;
    return frame.write(name);
}

std::shared_ptr<const LayerArrays> layers(Frame& frame) {
    const py::gil_scoped_release release;
    return frame.layers();
}

std::optional<double> error_value(const Frame& frame) {
    const std::optional<app::ImageError> error = frame.error();
    return error ? std::optional<double>(error->error.value) : std::nullopt;
}

}  // namespace

void add_render(py::module_& module) {
    py::class_<Progress>(module, "Progress", "How far a render is.")
        .def_readonly("fraction", &Progress::fraction, "Part of the work that is done, 0 to 1.")
        .def_readonly("spp", &Progress::spp, "Samples per pixel so far.")
        .def_readonly("elapsed", &Progress::elapsed, "Seconds since the first sample.")
        .def_readonly("left", &Progress::left, "Expected seconds to the end; None: not known.")
        .def_readonly("error", &Progress::error, "Relative standard error so far; None: not known.")
        .def("__repr__", [](const Progress& p) {
            return fmt::format("<velatura.Progress {:.1f} %, {:.3g} spp>", 100 * p.fraction, p.spp);
        });
    py::class_<Frame, std::shared_ptr<Frame>>(module, "Frame", "A rendered frame.")
        .def_property_readonly("layers", &layers,
                               "Its light layers and data layers, as Layers. Computed on first "
                               "use; the arrays then share one memory.")
        .def(
            "__getitem__",
            [](const py::object& frame, const std::string& name) -> py::object {
                return frame.attr("layers")[py::str(name)];
            },
            py::arg("name"), "Array of a layer, e.g. frame[\"rgba\"].")
        .def("write", &write, py::arg("path"),
             "Writes the EXR that `velatura render` writes, byte for byte. Returns the names of "
             "the files.")
        .def_property_readonly("reason", &Frame::reason,
                               "Why it ended: \"complete\", \"time\", \"target-error\" or "
                               "\"interrupted\".")
        .def_property_readonly(
            "spp", [](const Frame& f) { return f.noise().samples_mean; },
            "Samples per pixel, mean.")
        .def_property_readonly("seconds", &Frame::seconds, "Seconds that sampling took.")
        .def_property_readonly("error", &error_value,
                               "Relative standard error of the image; None: not known.")
        .def_property_readonly(
            "is_error_lower_bound",
            [](const Frame& f) {
                const auto error = f.error();
                return error && error->is_lower;
            },
            "Whether the error is a lower bound.")
        .def_property_readonly(
            "invalid", [](const Frame& f) { return f.noise().invalid; },
            "Number of bad samples, which were skipped.")
        .def_property_readonly(
            "diagnostics", [](const Frame& f) { return to_python(f.session()->messages()); },
            "Errors, warnings and notes of the scene and the render.");
    py::class_<Session, std::shared_ptr<Session>>(module, "Renderer",
                                                  "One frame of a scene, ready to be rendered.")
        .def(py::init(&open), py::arg("scene"),
             "Opens a USD scene: a file, or a SceneBuilder. Options are those of `velatura "
             "render`, with _ for -: spp=64, "
             "res=(1280, 720), bounces=2, camera=\"/World/Cam\", layers=[\"bounce\", \"light\"], "
             "halves=True … Raises Error (with file:line:column), UsageError, TypeError.")
        .def("render", &render, py::arg("progress") = py::none(),
             "Renders the frame. progress(Progress) is called in this thread, up to 50 times a "
             "second; False ends the render. Other threads run meanwhile. Raises `Canceled`, "
             "`Error`.")
        .def("cancel", &Session::cancel,
             "Ends a render in another thread, or in a progress function.")
        .def_property_readonly("plan", &effects_and_needs,
                               "Effects and needs, as `velatura plan --json`.")
        .def_property_readonly("width", &Session::width, "Pixels.")
        .def_property_readonly("height", &Session::height, "Pixels.")
        .def_property_readonly("time", &Session::time, "Time code of the frame.")
        .def_property_readonly("camera", &Session::camera, "Path of the camera prim.")
        .def_property_readonly(
            "diagnostics", [](const Session& s) { return to_python(s.messages()); },
            "Errors, warnings and notes so far.");
}

}  // namespace velatura::python
