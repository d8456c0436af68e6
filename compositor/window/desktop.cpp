// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/desktop.h"

#include "base/hash.h"
#include "compositor/window/folder_list.h"
#include "compositor/window/image_panel.h"
#include "compositor/window/menu_bar.h"
#include "compositor/window/mixer_panel.h"
#include "compositor/window/noise_panel.h"
#include "compositor/window/pixel_panel.h"
#include "compositor/window/widgets.h"

#include <fmt/format.h>

#include <algorithm>

namespace velatura::compositor::window {

namespace {

/// Tells requests apart.
uint64_t digest_of(const WorkRequest& request) {
    uint64_t digest = hash_combine(reinterpret_cast<uintptr_t>(request.levels.get()),
                                   hash_combine(request.level, request.noise_of));
    for (const auto& image : request.images)
        digest = hash_combine(digest, image ? image->version : 0);
    for (const int v : {request.seen.x0, request.seen.y0, request.seen.x1, request.seen.y1})
        digest = hash_combine(digest, uint64_t(v));
    return digest;
}

/// A panel at a fixed place.
class Panel {
  public:
    Panel(const char* name, const ImVec2& low, const ImVec2& size, ImGuiWindowFlags more = 0) {
        ImGui::SetNextWindowPos(low);
        ImGui::SetNextWindowSize(size);
        ImGui::Begin(name, nullptr,
                     ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize |
                         ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                         ImGuiWindowFlags_NoBringToFrontOnFocus |
                         ImGuiWindowFlags_NoScrollWithMouse | ImGuiWindowFlags_NoScrollbar | more);
    }

    ~Panel() { ImGui::End(); }

    Panel(const Panel&) = delete;
    Panel& operator=(const Panel&) = delete;
};

}  // namespace

Desktop::Desktop(const GlfwWindow& window, std::optional<double> frame)
    : frame_(frame),
      session_(RecentFiles(recent_list_path()), AutosavedLooks(autosave_folder())),
      drawing_{session_, textures_, {}, window.fonts(), {}, {}, {}, {}, {}, 0,
               {},       true,      {}, false,          {}, {}, {}, {}, {}, {},
               {}},
      worker_(GlfwWindow::wake),
      loading_(GlfwWindow::wake),
      comparing_(GlfwWindow::wake),
      saving_(GlfwWindow::wake),
      denoised_(GlfwWindow::wake) {
    if (auto displays = image::display_views()) {
        drawing_.displays = std::move(*displays);
    } else {
        session_.report(displays.error().message, true);
    }
    if (auto spaces = image::color_spaces()) drawing_.spaces = std::move(*spaces);
    drawing_.open_file = [this](const std::string& path) { open(path); };
    drawing_.open_compared = [this](const std::string& path) { open_compared(path); };
    drawing_.open_view = [this](const std::string& view) {
        set_stereo(view);
        open(session_.path());
    };
    drawing_.write_output = [this](const std::string& path) { write_output(path); };
}

void Desktop::open(const std::string& path) {
    if (path.ends_with(".json")) return session_.load_preset(path);
    if (is_live_)
        return session_.report("this window shows a render; open files with velatura-comp ui",
                               true);
    loading_.replace(loader(path));
    opened_ = {files_of(path), {}, nullptr};
    session_.report("loading " + path);
}

void Desktop::set_source(std::shared_ptr<LayerSource> source, const std::string& name) {
    source_ = std::move(source);
    followed_.paths = {name};
    is_live_ = true;
}

void Desktop::open_together(std::vector<std::string> paths) {
    together_ = std::move(paths);
    open(together_[0]);
}

void Desktop::open_compared(const std::string& path) {
    comparing_.replace(loader(path));
    session_.report("loading " + path);
}

std::vector<std::string> Desktop::files_of(const std::string& path) const {
    if (!together_.empty() && path == together_[0]) return together_;
    return {file_to_open(path, frame_)};
}

Jobs<Desktop::Loaded>::Work Desktop::loader(const std::string& path) const {
    return [paths = files_of(path), view = stereo_, has_file = session_.has_file()] {
        return load_files(paths, view, has_file);
    };
}

Result<Desktop::Loaded> Desktop::load_files(const std::vector<std::string>& paths,
                                            const std::string& view,
                                            bool is_lenient) {
    // Before they are read: what replaces them meanwhile is news to who follows them
    FileStates states = states_of(paths);
    auto levels = load_levels(paths, view);
    // A view that was chosen for one file is that of others as far as they have it
    if (!levels && is_lenient && levels.error().code == "unknown-view")
        levels = load_levels(paths, "");
    if (!levels) return levels.error();
    return Loaded{paths, std::move(states), std::move(*levels)};
}

void Desktop::press(const KeyPress& key, bool is_repeat) {
    if (session_.dialog() == Dialog::None) session_.press(key, is_repeat);
}

void Desktop::write_output(const std::string& path) {
    session_.report("saving " + path);
    saving_.add([path, write = session_.output_writer(path)]() -> Result<std::string> {
        const auto written = write();
        if (!written) return written.error();
        return "saved " + path + (written->empty() ? "" : ": " + *written);
    });
}

void Desktop::take_loaded() {
    auto loaded = loading_.take();
    if (!loaded) return;
    if (!*loaded) {
        session_.report(loaded->error().message, true);
        // What is not there, or not whole, may be replaced
        if (!session_.has_file() && session_.is_following()) follow(std::move(opened_));
        return;
    }
    show(**loaded);
    followed_ = std::move(**loaded);
    followed_.levels.reset();
    source_.reset();
}

void Desktop::show(const Loaded& file) {
    rendered_ = file.levels;
    is_denoised_ = false;
    textures_.show(file.levels);
    drawing_.noise.reset();
    drawing_.flagged.clear();
    drawing_.cursor.reset();
    session_.show(file.paths[0], file.levels, frame_, !is_live_);
}

/// Makes `files` those that are followed, from the state in which they were read.
void Desktop::follow(Loaded files) {
    const std::string view = session_.has_file() ? session_.stack().view() : stereo_;
    followed_ = std::move(files);
    source_ =
        std::make_shared<FileFollower>(followed_.paths, view, followed_.states, GlfwWindow::wake);
}

/// What replaced the layers that are shown.
void Desktop::take_renewed() {
    if (!is_live_ && !session_.is_following()) source_.reset();
    if (session_.is_following() && !source_ && !followed_.paths.empty() && !loading_.is_busy())
        follow(std::move(followed_));
    if (!source_) return;
    auto news = source_->take();
    drawing_.live_state = is_live_ ? source_->state() : std::string();
    if (!news) return;
    is_renewal_due_ = false;
    if (!*news) {
        std::string why = news->error().message;
        if (why.ends_with('.')) why.pop_back();
        return session_.report(
            why + (session_.has_file() ? "; showing the last image" : "; waiting for it"),
            session_.has_file());
    }
    renew(**news);
    if (is_live_ || !session_.has_file()) return;
    const layers::SampleInfo& samples = session_.stack().header().samples;
    session_.report(source_->state() +
                    (session_.stack().is_plain()
                         ? std::string(": read again")
                         : fmt::format(": {} spp", samples.end - samples.first)));
}

void Desktop::renew(const RenewedLayers& renewed) {
    if (!session_.has_file()) return show({followed_.paths, {}, renewed.levels});
    rendered_ = renewed.levels;
    // What is being denoised is of a camera or light that is no more
    if (renewed.is_other_image) denoised_.clear();
    // What is denoised stays until the same of these layers is there
    const bool waits = session_.is_denoising() && is_denoised_ && !renewed.is_other_image &&
                       renewed.levels->reduction() == 1;
    if (waits) return;
    is_denoised_ = false;
    replace_layers(renewed);
}

/// Shows layers as rendered or denoised, by the switch.
void Desktop::denoise() {
    if (!session_.has_file() || !rendered_) return;
    if (!session_.is_denoising()) {
        denoised_.clear();
        if (std::exchange(is_denoised_, false)) replace_layers({rendered_, false});
        return;
    }
    // A draft is soon replaced
    if (rendered_->reduction() == 1) denoised_.offer(rendered_);
    const auto done = denoised_.take();
    if (done && !*done) {
        session_.report("not denoised: " + done->error().message, true);
        session_.set_denoising(false);
    } else if (done && rendered_->reduction() == 1) {
        is_denoised_ = true;
        replace_layers({**done, false});
    }
    denoised_.advance(!source_ || source_->is_settled());
}

void Desktop::replace_layers(const RenewedLayers& renewed) {
    const bool is_same_size = renewed.levels->image_frame() == session_.image_frame();
    // A pixel of a draft is not that of the image
    if (!is_same_size || renewed.levels->reduction() != session_.reduction())
        drawing_.cursor.reset();
    textures_.renew(renewed.levels, is_same_size);
    session_.renew(renewed.levels, renewed.is_other_image);
}

void Desktop::take_compared() {
    const auto loaded = comparing_.take();
    if (!loaded) return;
    if (!*loaded) return session_.report(loaded->error().message, true);
    session_.compare((*loaded)->paths[0], (*loaded)->levels);
}

void Desktop::take_results() {
    WorkResults results = worker_.take();
    for (const FinishedTile& tile : results.tiles) {
        textures_.take(tile);
        if (tile.level == 0)
            drawing_.flagged.take(tile.look, tile.version, tile.window, tile.flagged);
    }
    if (!results.error.empty()) session_.report("not mixed: " + results.error, true);
    if (results.noise) drawing_.noise = std::move(results.noise);
    const ImageTask* image = session_.has_file() ? session_.image(session_.active()) : nullptr;
    drawing_.is_noise_old = !image || results.noise_version != image->version;
    drawing_.times = results.times;
    drawing_.is_working =
        !results.is_idle || loading_.is_busy() || comparing_.is_busy() || saving_.is_busy();
}

void Desktop::take_up() {
    take_loaded();
    take_compared();
    take_renewed();
    denoise();
    if (const auto saved = saving_.take())
        session_.report(*saved ? **saved : saved->error().message, !*saved);
    take_results();
}

bool Desktop::is_settled() const {
    if (source_ && !source_->is_settled()) return false;
    if (session_.is_denoising() && (denoised_.is_busy() || !denoised_.is_done())) return false;
    return !drawing_.is_working && !is_renewal_due_ && !loading_.is_busy() &&
           !comparing_.is_busy() && !saving_.is_busy();
}

void Desktop::request() {
    WorkRequest wanted = session_.work_request();
    const uint64_t digest = digest_of(wanted);
    if (digest == asked_) return;
    asked_ = digest;
    drawing_.is_working = true;
    worker_.request(std::move(wanted));
}

void Desktop::draw_workspace() {
    const ImVec2 screen = ImGui::GetIO().DisplaySize;
    const float unit = ImGui::GetFontSize();
    const bool has_file = session_.has_file();
    const float bar = ImGui::GetFrameHeight(), status = 1.9f * unit;
    const float tools = std::max(drawing_.toolbar_height, bar + 1.1f * unit);
    const float mixer = std::clamp(0.36f * screen.x, 32 * unit, 40 * unit);
    const float left = std::max(screen.x - mixer, 1.0f);
    const float numbers = std::clamp(0.27f * screen.y, 10 * unit, 17 * unit);
    const float noise = 17 * unit;
    const float strip = has_file ? SnapshotStrip::height(session_) : 0;
    const float low = screen.y - status;
    {
        const Panel panel("menus", {0, 0}, {screen.x, bar}, ImGuiWindowFlags_MenuBar);
        draw_menu_bar(drawing_);
    }
    if (has_file) {
        const Panel panel("tools", {0, bar}, {left, tools});
        draw_toolbar(drawing_);
    }
    {
        const float top = bar + (has_file ? tools : 0),
                    height = low - top - strip - (has_file ? numbers : 0);
        ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(0, 0));
        const Panel panel("picture", {0, top},
                          {has_file ? left : screen.x, std::max(height, 1.0f)});
        ImGui::PopStyleVar();
        draw_image(drawing_);
    }
    if (strip > 0) {
        const Panel panel("snapshots", {0, low - numbers - strip}, {left, strip},
                          ImGuiWindowFlags_HorizontalScrollbar);
        strip_.draw(drawing_);
    }
    if (has_file) {
        {
            const Panel panel("noise", {0, low - numbers}, {noise, numbers});
            draw_noise(drawing_);
        }
        {
            const Panel panel("pixel", {noise, low - numbers}, {left - noise, numbers});
            draw_pixel(drawing_);
        }
        const Panel panel("mixer", {left, bar}, {mixer, low - bar});
        draw_mixer(drawing_);
    }
    const Panel panel("status", {0, low}, {screen.x, status});
    draw_status_line(drawing_);
}

void Desktop::draw() {
    take_up();
    drawing_.marks.clear();
    draw_workspace();
    dialogs_.draw(drawing_);
    // A drag and a key that is held are one step of undo each
    if (!ImGui::IsAnyItemActive() && !GlfwWindow::is_key_held()) {
        session_.seal();
        session_.autosave_looks();
    }
    if (const auto wanted = session_.take_wanted_file()) open(*wanted);
    request();
}

}  // namespace velatura::compositor::window
