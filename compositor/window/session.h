// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/look/look_rows.h"
#include "compositor/window/actions.h"
#include "compositor/window/autosaved_looks.h"
#include "compositor/window/history.h"
#include "compositor/window/image_view.h"
#include "compositor/window/levels.h"
#include "compositor/window/matte_pick.h"
#include "compositor/window/outputs.h"
#include "compositor/window/pixel_shares.h"
#include "compositor/window/recent_files.h"
#include "compositor/window/snapshots.h"
#include "compositor/window/view_mode.h"
#include "compositor/window/worker.h"

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace velatura::compositor::window {

/// What the status line says.
struct Message {
    std::string text;
    bool is_error = false;
};

/// Pages of the mixer.
enum class Page { Lights, Bounces, Lobes, Cells, Shadows };

/// What stands before the mixer and waits for an answer.
enum class Dialog {
    None,
    OpenFile,
    OpenPreset,
    SavePreset,
    OpenCompared,
    WriteOutput,
    Replace,
    Quit,
    Help
};

/// Everything that the window is about, without a window: the file, both looks and what was done to
/// them, what is selected and seen. Drawing reads it and calls it; it calls nothing that draws.
class Session {
  public:
    explicit Session(RecentFiles recent, AutosavedLooks kept = AutosavedLooks());

    // The file

    /// The looks go on with another file, which leaves out what it lacks; the first file begins
    /// with the looks that were kept for it. frame: at which keys are read; none: that of the file.
    /// is_file: false for the file that a render will write.
    void show(std::string path,
              std::shared_ptr<const Levels> levels,
              std::optional<double> frame = std::nullopt,
              bool is_file = true);

    /// The same file with other layers: looks, undo, zoom and what is selected stay; what the look
    /// names and the new layers lack is skipped. is_other_image: see RenewedLayers.
    void renew(std::shared_ptr<const Levels> levels, bool is_other_image = false);

    /// The file is to be read again whenever it is replaced.
    bool is_following() const { return is_following_; }

    void set_following(bool is_following) { is_following_ = is_following; }

    bool has_file() const { return levels_ != nullptr; }

    /// Of the look that is edited, as rows and numbers are: that of B is the other file while there
    /// is one.
    const LayerStack& stack() const { return levels_of(active_)->stack(0); }

    /// What look B is of, beside what look A is of.
    void compare(std::string path, std::shared_ptr<const Levels> levels);
    void end_comparison();

    /// Empty: both looks are of one file.
    const std::string& compared() const { return compared_path_; }

    const std::string& path() const { return path_; }

    const MixerRows& rows() const { return compared_ && active_ == 1 ? compared_rows_ : rows_; }

    const RecentFiles& recent() const { return recent_; }

    // The looks. 0 is A, 1 is B

    size_t active() const { return active_; }

    const Look& look() const { return history_.now()[active_]; }

    const Look& look(size_t index) const { return history_.now()[index]; }

    /// Changes the active look. Changes of one gesture are one step of undo; an empty name is a
    /// step of its own.
    void edit(const std::string& gesture, const std::function<void(Look&)>& change);

    /// Ends the gesture.
    void seal() { history_.seal(); }

    /// True if a look would be lost that is neither a preset nor that of the render.
    bool has_unsaved_look() const;

    /// Keeps such looks for the next time that this file is opened, beside the presets; called when
    /// no gesture goes on.
    void autosave_looks();

    bool can_undo() const { return history_.can_undo(); }

    bool can_redo() const { return history_.can_redo(); }

    /// At which keys are read, and the image is that of: at first that of the file.
    double frame() const { return frame_; }

    void set_frame(double frame);

    /// Both looks: it is one monitor.
    void set_display(const std::string& display, const std::string& view);

    /// Color space of the numbers in the file, of both looks and the files that follow; empty:
    /// what the file says.
    const std::string& input_space() const { return input_space_; }

    void set_input_space(const std::string& space);

    /// What the file says of itself: `linear Rec.709 (chromaticities)`.
    const std::string& own_space() const { return own_space_; }

    bool is_soloing() const;

    // Mattes

    /// Clicks in the image pick objects.
    bool is_picking() const { return is_picking_; }

    const MattePicker& picker() const { return picker_; }

    const std::string& pick_layer() const { return pick_layer_; }

    /// Begins another matte.
    void set_pick_layer(const std::string& layer);

    /// Of the layer that is picked from, at a pixel of the image; most coverage first.
    std::vector<PickedObject> objects_at(int x, int y) const;

    /// Takes what covers most of that pixel into the matte, or out of it.
    void pick(int x, int y);

    const std::vector<std::string>& picked() const { return picked_; }

    /// Where the rows of the mixer act, as --matte takes it; empty: everywhere.
    const std::string& matte() const { return matte_; }

    void clear_matte();

    // Rows by their light at a pixel

    /// Of the image, under the mouse.
    void hover(const std::array<int, 2>& pixel) { hovered_ = pixel; }

    bool is_sorting() const { return sorted_at_.has_value(); }

    /// found() lists rows with more light at that pixel of the image first; none: in the file's
    /// order.
    void sort_rows_at(std::optional<std::array<int, 2>> pixel);

    /// What rows have of the light at that pixel, of the image as it is now; null: rows are not
    /// sorted.
    const PixelShares* pixel_shares();

    // Snapshots

    const std::vector<Snapshot>& snapshots() const { return snapshots_.all(); }

    /// Of the active look. Returns: whether there was an image that it could be of.
    bool take_snapshot();

    /// Look B becomes that image, which stays as it is.
    void compare_with_snapshot(size_t index);
    void use_look_of_snapshot(size_t index);

    void remove_snapshot(size_t index) { snapshots_.remove(index); }

    // What is shown

    /// All layers are to be shown denoised.
    bool is_denoising() const { return is_denoising_; }

    void set_denoising(bool is_denoising) { is_denoising_ = is_denoising; }

    /// The last mix of a look that the file can express; null before there is one.
    const ImageTask* image(size_t index) const;
    WorkRequest work_request() const;

    /// The image that is shown, in its own pixels, of which a draft has fewer.
    const image::Window& image_frame() const { return levels_->image_frame(); }

    /// Pixels of the image along a side of one of the layers: 1, but for drafts.
    int reduction() const { return levels_->reduction(); }

    /// The level that the screen shows.
    size_t level() const { return levels_->level_for(view_.scale()); }

    ImageView& view() { return view_; }

    const ImageView& view() const { return view_; }

    bool is_wiping() const { return is_wiping_; }

    double wipe() const { return wipe_; }  ///< share of the image's width that shows A

    void set_wipe(double share);

    /// What of the image is looked at; of both looks.
    const ViewMode& mode() const { return mode_; }

    void set_mode(ViewMode mode);

    /// Layers of the file that a mode may show.
    const std::vector<ShownLayer>& shown() const { return levels_->shown(); }

    /// One tile of the image of a look as it is on the screen, without marks.
    ShownTile screen_tile(size_t index, const image::Window& tile) const;

    /// The bytes that the screen shows of a scene-linear color in the numbers of the file, without
    /// exposure.
    std::array<uint8_t, 3> screen_color(const std::array<float, 3>& rgb) const;

    // What keys and menus do

    void perform(Action action);
    /// is_repeat: the key is held down; steps go on, and are one gesture.
    void press(const KeyPress& key, bool is_repeat = false);

    Page page() const { return page_; }

    void set_page(Page page);

    /// The lobe that the page of cells is about; empty: all.
    const std::string& lobe_of_cells() const { return lobe_of_cells_; }

    void set_lobe_of_cells(std::string lobe) { lobe_of_cells_ = std::move(lobe); }

    /// Rows of the page, whether the search finds them or not.
    const std::vector<std::string>& targets_of_page() const;

    /// Words that names of rows hold; empty: all rows are shown. The first row that is found is
    /// selected, so that keys work on what is seen.
    void search_rows(const std::string& words);

    const std::string& row_search() const { return row_search_; }

    /// Those that the search finds, in order.
    std::vector<std::string> found(const std::vector<std::string>& targets) const;

    /// Whether a key or menu wants to type into the search, once.
    bool take_search_request() { return std::exchange(wants_to_search_, false); }

    const std::string& selected() const { return selected_; }

    void select(const std::string& target) { selected_ = target; }

    Dialog dialog() const { return dialog_; }

    void set_dialog(Dialog dialog) { dialog_ = dialog; }

    bool wants_to_quit() const { return wants_to_quit_; }

    /// Quits, whatever is not saved.
    void quit() { wants_to_quit_ = true; }

    /// A file that keys or menus ask to open, once.
    std::optional<std::string> take_wanted_file() {
        return std::exchange(wanted_file_, std::nullopt);
    }

    // Files

    /// Of the active look; without a file the preset waits for one.
    void load_preset(const std::string& path);
    /// Over whatever is there; ask_to_replace() asks before.
    void save_preset(const std::string& path);

    /// Whether a preset or image saved there takes the place of a file. Then the dialog Replace
    /// asks, and replaced() says what for: SavePreset or WriteOutput, and where.
    bool ask_to_replace(Dialog what, const std::string& path);

    const std::pair<Dialog, std::string>& replaced() const { return replaced_; }

    /// Whether the file to be replaced is one whose layers are open.
    bool replaces_layers() const;

    /// What the dialog WriteOutput writes.
    OutputKind output() const { return output_; }

    /// What to run, in a thread of its own if need be, to write that of the active look. Returns:
    /// what there is to say, perhaps nothing.
    std::function<Result<std::string>()> output_writer(const std::string& path) const;

    const Message& message() const { return message_; }

    void report(std::string text, bool is_error = false);

    /// What keeps a look that is to be seen from it, the active one first: the image is that of a
    /// look before. Empty: nothing.
    std::string look_error() const;

    /// What the active look asks for and the file has no need of, or lacks.
    std::vector<std::string> notes() const;

  private:
    struct Preset {
        std::string path;
        Look look;
    };

    const std::shared_ptr<const Levels>& levels_of(size_t look) const {
        return look == 1 && compared_ ? compared_ : levels_;
    }

    void after_change();
    void begin_with(const std::string& path);
    void keep_mode();
    void keep_picks();
    RowTarget selected_row() const;
    void take_levels(std::shared_ptr<const Levels> levels);
    bool is_saved(const Look& look) const;
    void remember_saved(const Look& look);
    void want_neighbor(int step);
    void take_over(const Preset& preset);
    void refresh(size_t index);
    Result<void> read_mattes(size_t index, mix::MixPlan& plan) const;
    Result<mix::MixPlan> plan_for(size_t index, const Look& look) const;
    Result<ViewMode> mode_of(size_t index) const;
    Result<std::shared_ptr<const image::DisplayTransform>> transform_for(size_t index,
                                                                         const Look& look);
    std::vector<std::string> keyed_rows() const;
    void select_neighbor(int step);
    void show_neighbor_layer(int step);
    bool show_channel(Action action);
    void nudge_gain(float stops);
    void nudge_exposure(float stops);
    void perform_on_row(Action action);
    bool perform_on_view(Action action);

    RecentFiles recent_;
    AutosavedLooks kept_;
    std::vector<Look> saved_;         ///< presets that were loaded or saved
    std::optional<Looks> last_kept_;  ///< of this file
    std::string path_;
    std::shared_ptr<const Levels> levels_;
    MixerRows rows_;
    std::string compared_path_;
    std::shared_ptr<const Levels> compared_;  ///< of look B; null: it is of the same file
    MixerRows compared_rows_;
    History history_;
    size_t active_ = 0;
    double frame_ = 0;

    std::optional<Preset> waiting_;  ///< for a file
    std::optional<std::string> wanted_file_;
    std::pair<Dialog, std::string> replaced_ = {Dialog::None, {}};
    /// Looks made for another file leave out what this one lacks; what they left out, line by line
    std::array<bool, 2> is_fitted_ = {false, false};
    std::array<std::vector<std::string>, 2> omitted_;
    std::array<std::shared_ptr<const ImageTask>, 2> images_;
    std::array<std::string, 2> look_errors_;
    uint64_t last_version_ = 0;
    std::map<std::array<std::string, 4>, std::shared_ptr<const image::DisplayTransform>>
        transforms_;  ///< by file, display, view and input space
    Snapshots snapshots_;
    std::optional<std::array<int, 2>> hovered_, sorted_at_;
    std::optional<PixelShares> shares_;
    std::pair<uint64_t, Page> shares_of_ = {0, Page::Lights};  ///< image and page
    MattePicker picker_;
    std::vector<std::string> picked_;
    ImageView view_;
    ViewMode mode_;
    bool is_picking_ = false, is_wiping_ = false, wants_to_quit_ = false, wants_to_search_ = false,
         is_following_ = false, is_denoising_ = false;
    double wipe_ = 0.5;
    Page page_ = Page::Lights;
    std::string lobe_of_cells_;
    std::string pick_layer_, matte_, selected_, row_search_, input_space_, own_space_;
    Dialog dialog_ = Dialog::None;
    OutputKind output_ = OutputKind::Image;
    Message message_;
};

}  // namespace velatura::compositor::window
