// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/window/denoised_layers.h"
#include "compositor/window/dialogs.h"
#include "compositor/window/drawing.h"
#include "compositor/window/file_follower.h"
#include "compositor/window/glfw_window.h"
#include "compositor/window/jobs.h"
#include "compositor/window/snapshot_strip.h"
#include "compositor/window/worker.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace velatura::compositor::window {

/// All panels, and what goes on behind them: loading, mixing, saving.
class Desktop {
  public:
    /// frame: at which keys are read; none: that of the file.
    Desktop(const GlfwWindow& window, std::optional<double> frame);

    /// Layers, which are loaded in the background, or a preset (.json).
    void open(const std::string& path);

    /// One AOV in each (input_files.h), by the name of the first, which opens all of them again.
    void open_together(std::vector<std::string> paths);

    /// The layers are those of a render that will write the file `name`: no other file is opened.
    void set_source(std::shared_ptr<LayerSource> source, const std::string& name);

    /// What the owner of such a source adds to the window; set before the first draw().
    LiveHooks& hooks() { return drawing_.live; }

    Session& session() { return session_; }

    /// Of the file's numbers; empty: what the file says.
    void set_input_space(const std::string& space) { session_.set_input_space(space); }

    /// View of the stereo files that are opened from here on; empty: the first of each.
    void set_stereo(const std::string& view) { stereo_ = view; }

    /// The file is read again when it is replaced.
    void set_following(bool is_following) { session_.set_following(is_following); }

    /// The file was replaced: what follows it has not settled before it was read again.
    void expect_renewal() { is_renewal_due_ = session_.is_following(); }

    void load_preset(const std::string& path) { session_.load_preset(path); }

    void press(const KeyPress& key, bool is_repeat);

    /// Takes up what became ready and draws everything.
    void draw();

    bool wants_to_quit() const { return session_.wants_to_quit(); }

    /// What was asked to be saved is not all on the disk.
    bool is_saving() const { return saving_.is_busy(); }

    /// Nothing is being loaded, mixed or saved.
    bool is_settled() const;

    const Marks& marks() const { return drawing_.marks; }

    const MixTimes& times() const { return drawing_.times; }

    /// The first file could not be loaded, and nothing waits for it.
    bool has_failed() const {
        return !session_.has_file() && session_.message().is_error && !session_.is_following();
    }

    const Session& session() const { return session_; }

  private:
    struct Loaded {
        std::vector<std::string> paths;  ///< by the first of them it is called
        FileStates states;
        std::shared_ptr<const Levels> levels;
    };

    void take_up();
    static Result<Loaded> load_files(const std::vector<std::string>& paths,
                                     const std::string& view,
                                     bool is_lenient);
    std::vector<std::string> files_of(const std::string& path) const;
    Jobs<Loaded>::Work loader(const std::string& path) const;
    void open_compared(const std::string& path);
    void take_loaded();
    void take_compared();
    void show(const Loaded& file);
    void follow(Loaded files);
    void take_renewed();
    void renew(const RenewedLayers& renewed);
    void replace_layers(const RenewedLayers& renewed);
    void denoise();
    void take_results();
    void write_output(const std::string& path);
    void draw_workspace();
    void request();

    std::optional<double> frame_;
    std::string stereo_;
    std::vector<std::string> together_;
    Session session_;
    Textures textures_;
    Drawing drawing_;
    Dialogs dialogs_;
    SnapshotStrip strip_;
    Worker worker_;
    uint64_t asked_ = 0;  ///< digest of the last request
    Jobs<Loaded> loading_;
    Jobs<Loaded> comparing_;    ///< what look B is of
    Jobs<std::string> saving_;  ///< what is said of it
    Loaded opened_;             ///< what is being loaded, or could not be
    Loaded followed_;           ///< what is shown, without its layers
    bool is_renewal_due_ = false;
    std::shared_ptr<LayerSource> source_;  ///< null: nothing renews the layers
    bool is_live_ = false;                 ///< the source is a render, not a file
    DenoisedLayers denoised_;
    std::shared_ptr<const Levels> rendered_;  ///< the newest layers without denoising
    bool is_denoised_ = false;                ///< what is shown
};

}  // namespace velatura::compositor::window
