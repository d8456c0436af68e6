// SPDX-License-Identifier: Apache-2.0
#include "compositor/window/session.h"

#include "base/atomic_file.h"
#include "compositor/io/file_frame.h"
#include "compositor/look/stack_color.h"
#include "compositor/mix/fit_look.h"
#include "compositor/window/folder_list.h"
#include "compositor/window/names_shown.h"
#include "layers/layer_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <utility>

namespace velatura::compositor::window {

namespace {

constexpr size_t longest_preset_bytes = size_t(1) << 24;
constexpr float coarse_step = 0.25f, fine_step = 0.05f;  // stops
constexpr float max_stops = 20;

/// The light as it was rendered, on that look's monitor.
Look as_rendered(const Look& look) {
    Look fresh;
    fresh.display = look.display;
    fresh.view = look.view;
    return fresh;
}

bool is_plain(const Look& look) {
    return same_look(look, as_rendered(look));
}

/// Looks of a frame that say the same, at the same values of their keys.
bool same_image(const Look& a, const Look& b) {
    return same_look(a, b) && a.input_space == b.input_space &&
           std::equal(a.controls.begin(), a.controls.end(), b.controls.begin(), b.controls.end(),
                      [](const Control& c, const Control& d) { return c.factor == d.factor; });
}

/// `; NaN or Inf in key.R, key.G (taken as 0)`, at most three of them; empty: all are finite.
std::string not_finite_text(const Levels& levels) {
    const std::set<std::string>& channels = levels.not_finite();
    if (channels.empty()) return {};
    std::string list;
    size_t count = 0;
    for (const std::string& channel : channels) {
        if (++count > 3) break;
        list += (list.empty() ? "" : ", ") + channel;
    }
    if (channels.size() > 3) list += fmt::format(" and {} more", channels.size() - 3);
    return "; NaN or Inf in " + list + " (taken as 0)";
}

/// How the file was read.
std::string notes_text(const LayerStack& stack) {
    std::string text;
    for (const std::string& note : stack.notes()) text += "; " + note;
    return text;
}

}  // namespace

Session::Session(RecentFiles recent, AutosavedLooks kept)
    : recent_(std::move(recent)), kept_(std::move(kept)) {}

void Session::show(std::string path,
                   std::shared_ptr<const Levels> levels,
                   std::optional<double> frame,
                   bool is_file) {
    autosave_looks();
    const bool is_first = !has_file();
    if (is_file) recent_.add(path);
    begin_with(path);
    path_ = std::move(path);
    last_kept_.reset();
    if (is_first) active_ = 0;
    frame_ = frame ? *frame : frame_of(levels->stack(0).image()).value_or(0);
    take_levels(std::move(levels));
    set_page(is_first ? Page::Lights : page_);
    after_change();
    const LayerStack& file = levels_->stack(0);
    const size_t rows_of_file = file.header().lights.size();
    report(fmt::format(
               "{} layers, {} {}", file.header().layers.size(), rows_of_file,
               file.is_plain() ? "rows of a file without a header of Velatura" : "light groups") +
           notes_text(stack()) + not_finite_text(*levels_) +
           (is_plain(look()) ? "" : "; the look is the one from before (Ctrl+R: as rendered)"));
    if (waiting_) take_over(*std::exchange(waiting_, std::nullopt));
}

/// Everything that follows from the layers alone.
void Session::take_levels(std::shared_ptr<const Levels> levels) {
    levels_ = std::move(levels);
    const LayerStack& file = levels_->stack(0);
    rows_ = mixer_rows(file);
    if (compared_ && compared_->image_frame() != levels_->image_frame()) end_comparison();
    images_ = {};
    transforms_.clear();
    keep_mode();
    keep_picks();
    const auto color = color_of_stack(file, {});
    own_space_ = color ? fmt::format("{} ({})", color->label, color->reason) : std::string("file");
    view_.set_image(levels_->image_frame().width(), levels_->image_frame().height());
}

void Session::renew(std::shared_ptr<const Levels> levels, bool is_other_image) {
    const auto before = images_;
    is_fitted_.fill(true);
    take_levels(std::move(levels));
    // Stays on the row, unless there is no such row any more
    set_page(page_);
    after_change();
    for (size_t i = 0; i < 2 && !is_other_image; ++i) {
        if (!images_[i] || !before[i] || !same_image(before[i]->look, images_[i]->look) ||
            before[i]->mode != images_[i]->mode)
            continue;
        ImageTask same_look = *images_[i];
        same_look.look_version = before[i]->look_version;
        images_[i] = std::make_shared<const ImageTask>(std::move(same_look));
    }
}

/// The looks of the file before go on; else those that were kept for this one come back. The last
/// step of undo leads to the others.
void Session::begin_with(const std::string& path) {
    const bool continues = !is_plain(look(0)) || !is_plain(look(1));
    const auto kept = path == path_ ? std::nullopt : kept_.find(path);
    is_fitted_.fill(continues || kept);
    if (!continues) history_.reset({as_rendered(look()), as_rendered(look())});
    if (!kept) return;
    Looks earlier = *kept;
    for (Look& l : earlier) {
        l.display = look().display;
        l.view = look().view;
    }
    const Looks now = history_.now();
    history_.change(std::move(earlier), "");
    if (continues) history_.change(now, "");
}

bool Session::is_saved(const Look& look) const {
    if (is_plain(look)) return true;
    return std::any_of(saved_.begin(), saved_.end(), [&](Look preset) {
        // The monitor is no part of it
        preset.display = look.display;
        preset.view = look.view;
        return same_look(preset, look);
    });
}

void Session::remember_saved(const Look& look) {
    if (!is_saved(look)) saved_.push_back(look);
}

bool Session::has_unsaved_look() const {
    return !is_saved(look(0)) || !is_saved(look(1));
}

void Session::autosave_looks() {
    if (!has_file()) return;
    const Looks& now = history_.now();
    if (last_kept_ && same_look(now[0], (*last_kept_)[0]) && same_look(now[1], (*last_kept_)[1]))
        return;
    last_kept_ = now;
    if (!has_unsaved_look()) return kept_.drop(path_);
    if (const auto written = kept_.keep(path_, now); !written)
        report("the look cannot be saved: " + written.error().message, true);
}

void Session::edit(const std::string& gesture, const std::function<void(Look&)>& change) {
    Looks looks = history_.now();
    change(looks[active_]);
    history_.change(std::move(looks), gesture);
    after_change();
}

void Session::set_frame(double frame) {
    if (!std::isfinite(frame)) return;
    frame_ = frame;
    after_change();
}

void Session::set_display(const std::string& display, const std::string& view) {
    Looks looks = history_.now();
    for (Look& look : looks) {
        look.display = display;
        look.view = view;
    }
    history_.change(std::move(looks), "");
    after_change();
}

RowTarget Session::selected_row() const {
    return {selected_, matte()};
}

void Session::set_input_space(const std::string& space) {
    input_space_ = space;
    after_change();
}

bool Session::is_soloing() const {
    const auto& controls = look().controls;
    return std::any_of(controls.begin(), controls.end(),
                       [](const Control& c) { return c.kind == Control::Kind::Solo; });
}

void Session::after_change() {
    if (!has_file()) return;
    refresh(0);
    refresh(1);
}

void Session::refresh(size_t index) {
    Look wanted = look_at(look(index), frame_);
    std::shared_ptr<const ImageTask>& image = images_[index];
    look_errors_[index].clear();
    omitted_[index].clear();
    if (is_fitted_[index]) {
        mix::FittedLook fitted = mix::fit_look(levels_of(index)->stack(0), wanted);
        wanted = std::move(fitted.look);
        omitted_[index] = std::move(fitted.omitted);
    }
    wanted.input_space = input_space_;
    const auto mode = mode_of(index);
    if (!mode) {
        look_errors_[index] = mode.error().message;
        return;
    }
    if (image && same_image(image->look, wanted) && image->mode == *mode &&
        image->levels == levels_of(index))
        return;
    auto plan = plan_for(index, wanted);
    if (!plan) {
        look_errors_[index] = plan.error().message;
        return;
    }
    auto transform = transform_for(index, wanted);
    if (!transform) {
        look_errors_[index] = transform.error().message;
        return;
    }
    std::vector<LevelPlans> earlier;
    for (const auto& known : images_) {
        if (!known || known->levels != levels_of(index)) continue;
        earlier.push_back(known->plans);
        if (!known->matte.empty()) earlier.push_back(known->matte);
    }
    LevelPlans drawn;
    if (!mode->matte.empty()) {
        mix::MixPlan of_matte;
        of_matte.mattes.push_back({mode->matte, nullptr, {}});
        if (auto read = read_mattes(index, of_matte); !read) {
            look_errors_[index] = read.error().message;
            return;
        }
        drawn = plans_by_level(*levels_of(index), std::move(of_matte), earlier);
    }
    image = std::make_shared<const ImageTask>(ImageTask{
        ++last_version_, wanted, plans_by_level(*levels_of(index), std::move(*plan), earlier),
        std::move(*transform), *mode, levels_of(index), std::move(drawn)});
}

/// The values of a plan's mattes; those of the looks as they were are not read again.
Result<void> Session::read_mattes(size_t index, mix::MixPlan& plan) const {
    const auto is_known = [&](Matte& matte) {
        for (const auto& image : images_) {
            if (!image || image->levels != levels_of(index)) continue;
            std::vector<Matte> known = image->plans[0]->mattes;
            if (!image->matte.empty()) known.push_back(image->matte[0]->mattes[0]);
            for (const Matte& one : known) {
                if (one.text != matte.text) continue;
                matte = one;
                return true;
            }
        }
        return false;
    };
    for (Matte& matte : plan.mattes) {
        if (is_known(matte)) continue;
        auto loaded = load_matte(levels_of(index)->stack(0), nullptr, matte.text);
        if (!loaded) return loaded.error();
        matte = std::move(*loaded);
    }
    return {};
}

/// As plan_mix.
Result<mix::MixPlan> Session::plan_for(size_t index, const Look& look) const {
    auto plan = mix::plan_gains(levels_of(index)->stack(0), look);
    if (!plan) return plan;
    if (auto read = read_mattes(index, *plan); !read) return read.error();
    return plan;
}

std::vector<std::string> Session::notes() const {
    const auto& image = images_[active_];
    if (!image || !look_errors_[active_].empty()) return {};
    std::vector<std::string> notes = image->plans[0]->notes;
    for (const std::string& line : omitted_[active_]) notes.push_back("skipped " + line);
    return notes;
}

std::string Session::look_error() const {
    if (!look_errors_[active_].empty() || !is_wiping_) return look_errors_[active_];
    const size_t other = 1 - active_;
    if (look_errors_[other].empty()) return {};
    return fmt::format("look {}: {}", other == 0 ? "A" : "B", look_errors_[other]);
}

Result<std::shared_ptr<const image::DisplayTransform>> Session::transform_for(size_t index,
                                                                              const Look& look) {
    auto& known = transforms_[{compared_ && index == 1 ? compared_path_ : path_, look.display,
                               look.view, look.input_space}];
    if (known) return known;
    const auto color = color_of_stack(levels_of(index)->stack(0), look);
    if (!color) return color.error();
    auto made = image::DisplayTransform::make(look.display, look.view, *color);
    if (!made) return made.error();
    if (!made->warnings().empty()) report(fmt::format("{}", fmt::join(made->warnings(), "; ")));
    known = std::make_shared<const image::DisplayTransform>(std::move(*made));
    return known;
}

const ImageTask* Session::image(size_t index) const {
    return images_[index].get();
}

WorkRequest Session::work_request() const {
    WorkRequest request;
    if (!has_file()) return request;
    request.levels = levels_;
    request.level = level();
    request.seen = view_.visible();
    // In pixels of a draft
    const int k = levels_->reduction();
    request.seen = {request.seen.x0 / k, request.seen.y0 / k, (request.seen.x1 + k - 1) / k,
                    (request.seen.y1 + k - 1) / k};
    request.noise_of = active_;
    for (size_t i = 0; i < 2; ++i) {
        // Beside a draft there is nothing of the file that it is compared with
        const bool has_same_tiles = levels_of(i)->frame(0) == levels_->frame(0);
        if ((is_wiping_ || i == active_) && has_same_tiles) request.images[i] = images_[i];
    }
    return request;
}

const std::vector<std::string>& Session::targets_of_page() const {
    switch (page_) {
        case Page::Bounces:
            return rows().bounces;
        case Page::Lobes:
            return rows().lobes;
        case Page::Cells:
            return rows().groups;
        case Page::Shadows:
            return rows().shadows;
        default:
            return rows().lights;
    }
}

/// Rows that keys work on.
std::vector<std::string> Session::keyed_rows() const {
    return found(page_ == Page::Bounces ? rows().bounces
                 : page_ == Page::Lobes ? rows().lobes
                                        : rows().lights);
}

void Session::set_page(Page page) {
    page_ = page;
    const std::vector<std::string> list = keyed_rows();
    if (std::find(list.begin(), list.end(), selected_) == list.end())
        selected_ = list.empty() ? std::string() : list.front();
}

void Session::search_rows(const std::string& words) {
    row_search_ = words;
    set_page(page_);
}

std::vector<std::string> Session::found(const std::vector<std::string>& targets) const {
    std::vector<std::string> found;
    std::copy_if(targets.begin(), targets.end(), std::back_inserter(found),
                 [&](const std::string& t) { return is_found(row_title(t), row_search_); });
    return sorted_at_ && shares_ ? shares_->sorted(std::move(found)) : found;
}

void Session::select_neighbor(int step) {
    const std::vector<std::string> list = keyed_rows();
    if (list.empty()) return;
    const auto at = std::find(list.begin(), list.end(), selected_);
    const auto index = at == list.end() ? 0 : int(at - list.begin()) + step;
    selected_ = list[size_t(std::clamp(index, 0, int(list.size()) - 1))];
}

void Session::nudge_gain(float stops) {
    const float now = row_state(look(), selected_row()).stops;
    edit("step " + selected_, [&](Look& l) {
        set_stops(l, selected_row(), std::clamp(now + stops, -max_stops, max_stops));
    });
}

void Session::nudge_exposure(float stops) {
    edit("step exposure", [&](Look& l) {
        l.exposure_stops = std::clamp(l.exposure_stops + stops, -max_stops, max_stops);
    });
}

void Session::perform_on_row(Action action) {
    if (selected_.empty()) return;
    const RowState row = row_state(look(), selected_row());
    switch (action) {
        case Action::MuteRow:
            return edit("", [&](Look& l) { set_muted(l, selected_row(), !row.is_muted); });
        case Action::SoloRow:
            return edit("", [&](Look& l) { set_soloed(l, selected_row(), !row.is_soloed); });
        case Action::ResetRow:
            return edit("", [&](Look& l) { reset_row(l, selected_row()); });
        case Action::GainUp:
            return nudge_gain(coarse_step);
        case Action::GainDown:
            return nudge_gain(-coarse_step);
        case Action::GainUpFine:
            return nudge_gain(fine_step);
        case Action::GainDownFine:
            return nudge_gain(-fine_step);
        default:
            return;
    }
}

void Session::perform(Action action) {
    switch (action) {
        case Action::OpenFile:
            return set_dialog(Dialog::OpenFile);
        case Action::OpenPreset:
            return set_dialog(Dialog::OpenPreset);
        case Action::ShowHelp:
            return set_dialog(Dialog::Help);
        case Action::Quit:
            return has_unsaved_look() ? set_dialog(Dialog::Quit) : quit();
        default:
            break;
    }
    // All others need something to work on
    if (!has_file()) return;
    if (const auto output = output_of(action)) {
        output_ = *output;
        return set_dialog(Dialog::WriteOutput);
    }
    switch (action) {
        case Action::SavePreset:
            return set_dialog(Dialog::SavePreset);
        case Action::Compare:
            return set_dialog(Dialog::OpenCompared);
        case Action::EndComparison:
            return end_comparison();
        case Action::Reload:
            wanted_file_ = path_;
            return;
        case Action::Follow:
            set_following(!is_following());
            return report(is_following() ? "following " + path_ + ": it is read when it is replaced"
                                         : "not following " + path_);
        case Action::PreviousFrame:
            return want_neighbor(-1);
        case Action::NextFrame:
            return want_neighbor(1);
        case Action::Undo:
            if (history_.undo()) after_change();
            return;
        case Action::Redo:
            if (history_.redo()) after_change();
            return;
        case Action::ResetAll:
            return edit("", [](Look& l) {
                l.controls.clear();
                l.exposure_stops = 0;
            });
        case Action::PreviousRow:
            return select_neighbor(-1);
        case Action::NextRow:
            return select_neighbor(1);
        case Action::SearchRows:
            wants_to_search_ = true;
            return;
        case Action::ExposureUp:
            return nudge_exposure(coarse_step);
        case Action::ExposureDown:
            return nudge_exposure(-coarse_step);
        case Action::ExposureReset:
            return edit("", [](Look& l) { l.exposure_stops = 0; });
        case Action::CopyLook: {
            Looks looks = history_.now();
            looks[1 - active_] = looks[active_];
            history_.change(std::move(looks), "");
            return after_change();
        }
        default:
            if (!perform_on_view(action)) perform_on_row(action);
            return;
    }
}

void Session::want_neighbor(int step) {
    wanted_file_ = frame_beside(path_, step);
    if (!wanted_file_)
        report(fmt::format("no frame {} {}", step < 0 ? "before" : "after", path_), true);
}

void Session::press(const KeyPress& key, bool is_repeat) {
    const auto action = action_of(key);
    if (!action || (is_repeat && !repeats(*action))) return;
    if (!is_repeat) seal();
    perform(*action);
}

void Session::load_preset(const std::string& path) {
    const auto text = read_file(path, longest_preset_bytes);
    if (!text) return report(text.error().message, true);
    const auto loaded = look_from_json(*text);
    if (!loaded) return report(path + ": " + loaded.error().message, true);
    remember_saved(*loaded);
    const Preset preset = {path, *loaded};
    if (has_file()) return take_over(preset);
    waiting_ = preset;
    report(path + " waits for light layers: drop or open a file");
}

void Session::take_over(const Preset& preset) {
    is_fitted_[active_] = false;
    edit("", [&](Look& l) { l = preset.look; });
    report(fmt::format("look {} is that of {}{}", active_ == 0 ? "A" : "B", preset.path,
                       has_keys(preset.look) ? fmt::format(", its keys at frame {}", frame_) : ""));
}

void Session::save_preset(const std::string& path) {
    const auto saved = write_file_atomically(path, look_to_json(look()));
    if (!saved) return report(saved.error().message, true);
    remember_saved(look());
    last_kept_.reset();
    autosave_looks();
    report("saved " + path);
}

bool Session::ask_to_replace(Dialog what, const std::string& path) {
    const std::vector<std::string> files =
        what == Dialog::WriteOutput ? files_of(output_, path) : std::vector<std::string>{path};
    const auto at = std::find_if(files.begin(), files.end(), [](const std::string& file) {
        std::error_code unknown;
        return std::filesystem::exists(file, unknown);
    });
    if (at == files.end()) return false;
    replaced_ = {what, path};
    set_dialog(Dialog::Replace);
    return true;
}

bool Session::replaces_layers() const {
    std::error_code unknown;
    return std::filesystem::equivalent(replaced_.second, path_, unknown) ||
           (compared_ && std::filesystem::equivalent(replaced_.second, compared_path_, unknown));
}

std::function<Result<std::string>()> Session::output_writer(const std::string& path) const {
    const auto& image = images_[active_];
    // The last image that could be shown is none of this look
    if (const std::string& why = look_errors_[active_]; !why.empty() || !image) {
        const std::string message = why.empty() ? "there is no image" : why;
        return [message] { return Result<std::string>(Error{"no-picture", message}); };
    }
    return [source = OutputSource{compared_ && active_ == 1 ? compared_path_ : path_,
                                  levels_of(active_), image},
            write = output_of(output_).write, path] { return write(source, path); };
}

void Session::report(std::string text, bool is_error) {
    message_ = {std::move(text), is_error};
}

}  // namespace velatura::compositor::window
