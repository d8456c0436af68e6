// SPDX-License-Identifier: Apache-2.0
// What of the image is seen: modes, mattes that are picked, another file beside this one.
#include "compositor/window/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <utility>

namespace velatura::compositor::window {

namespace {

constexpr double zoom_step = 1.25;

/// The largest value of a channel; none: it is not stored.
std::optional<float> most_of(const LayerStack& stack, const std::string& name) {
    for (const image::Part& part : stack.image().parts) {
        const image::Channel* channel = part.find(name);
        if (!channel) continue;
        float most = 0;
        for (size_t i = 0; i < channel->size(); ++i) most = std::max(most, channel->value(i));
        return most;
    }
    return std::nullopt;
}

}  // namespace

void Session::set_mode(ViewMode mode) {
    mode_ = std::move(mode);
    after_change();
}

/// The layer of that name of the new file, if it has one.
void Session::keep_mode() {
    if (!mode_.layer) return;
    const auto at = std::find_if(shown().begin(), shown().end(),
                                 [&](const ShownLayer& l) { return l.name == mode_.layer->name; });
    mode_.layer = at == shown().end() ? std::nullopt : std::optional(*at);
}

ShownTile Session::screen_tile(size_t index, const image::Window& tile) const {
    const ImageTask& task = *images_[index];
    ViewMode mode = task.mode;
    mode.flags_pixels = false;
    const Levels& levels = *task.levels;
    return show_tile({levels.stack(0), *task.plans[0], task.look.exposure_stops, *task.transform,
                      levels.not_finite()},
                     mode, tile);
}

std::array<uint8_t, 3> Session::screen_color(const std::array<float, 3>& rgb) const {
    const auto& image = images_[active_];
    if (!image) return {255, 255, 255};
    const auto rgba = display_rgba({rgb[0], rgb[1], rgb[2]}, *image->transform);
    return {rgba[0], rgba[1], rgba[2]};
}

/// The mix stands before the first layer.
void Session::show_neighbor_layer(int step) {
    int index = -1;
    for (size_t i = 0; i < shown().size(); ++i) {
        if (mode_.layer == shown()[i]) index = int(i);
    }
    index = std::clamp(index + step, -1, int(shown().size()) - 1);
    ViewMode mode = mode_;
    mode.layer = index < 0 ? std::nullopt : std::optional(shown()[size_t(index)]);
    set_mode(std::move(mode));
}

/// False for an action that is about no channel. The channel that is shown already: back to color.
bool Session::show_channel(Action action) {
    for (const ChannelChoice& choice : channel_choices()) {
        if (choice.action != action) continue;
        ViewMode mode = mode_;
        mode.channel = mode.channel == choice.channel ? ShownChannel::Color : choice.channel;
        set_mode(std::move(mode));
        return true;
    }
    return false;
}

/// The mode, whose layer the compared file calls the same but may store elsewhere, with the matte
/// that is being picked.
Result<ViewMode> Session::mode_of(size_t index) const {
    ViewMode mode = mode_;
    if (is_picking_) mode.matte = matte_;
    if (const std::string needed = layer_of(mode.false_color); !needed.empty()) {
        const auto most = most_of(levels_of(index)->stack(0), needed);
        if (!most)
            return Error{"no-layer",
                         fmt::format("{} has no layer '{}', which this view is made "
                                     "from (--layers data)",
                                     index == 1 && compared_ ? compared_path_ : path_, needed)};
        mode.most_samples = mode.false_color == FalseColor::Samples ? *most : 0;
    }
    if (!mode_.layer || levels_of(index) == levels_) return mode;
    for (const ShownLayer& layer : compared_->shown()) {
        if (layer.name != mode_.layer->name) continue;
        mode.layer = layer;
        return mode;
    }
    return Error{"no-layer",
                 fmt::format("{} has no layer '{}'", compared_path_, mode_.layer->name)};
}

std::vector<PickedObject> Session::objects_at(int x, int y) const {
    return picker_.at(levels_->stack(0), pick_layer_, x, y);
}

void Session::pick(int x, int y) {
    const std::vector<PickedObject> objects = objects_at(x, y);
    if (objects.empty()) return;
    const PickedObject& object = objects.front();
    if (object.name.empty())
        return report(object.text() + " in the manifest of " + pick_layer_ + ": not picked", true);
    const auto at = std::find(picked_.begin(), picked_.end(), object.name);
    if (at == picked_.end()) {
        picked_.push_back(object.name);
    } else {
        picked_.erase(at);
    }
    matte_ = matte_text(pick_layer_, picked_);
    after_change();
    report(matte_.empty() ? "rows act everywhere" : "rows act within " + matte_);
}

void Session::set_pick_layer(const std::string& layer) {
    pick_layer_ = layer;
    clear_matte();
}

void Session::clear_matte() {
    picked_.clear();
    matte_.clear();
    after_change();
}

/// Of a new file: the Cryptomatte of that name goes on, else its first.
void Session::keep_picks() {
    picker_ = MattePicker(levels_->stack(0));
    const std::vector<std::string>& layers = picker_.layers();
    if (std::find(layers.begin(), layers.end(), pick_layer_) != layers.end()) return;
    is_picking_ = false;
    pick_layer_ = layers.empty() ? std::string() : layers.front();
    picked_.clear();
    matte_.clear();
}

void Session::compare(std::string path, std::shared_ptr<const Levels> levels) {
    if (!has_file()) return;
    const image::Window a = levels_->image_frame(), b = levels->image_frame();
    if (a != b)
        return report(fmt::format("not compared: {} has {}×{} pixels, {} has {}×{}", path,
                                  b.width(), b.height(), path_, a.width(), a.height()),
                      true);
    std::erase_if(transforms_, [&](const auto& known) { return known.first[0] == path; });
    compared_ = std::move(levels);
    compared_path_ = std::move(path);
    compared_rows_ = mixer_rows(compared_->stack(0));
    // What look B has from another file is left out where this one lacks it
    is_fitted_[1] = true;
    images_[1].reset();
    is_wiping_ = true;
    set_page(page_);
    after_change();
    report("B is " + compared_path_);
}

void Session::end_comparison() {
    compared_.reset();
    compared_path_.clear();
    images_[1].reset();
    after_change();
}

void Session::set_wipe(double share) {
    wipe_ = std::clamp(share, 0.0, 1.0);
}

bool Session::take_snapshot() {
    const auto& image = images_[active_];
    if (!image || !image->levels || image->levels->reduction() > 1) {
        report("no snapshot of a draft: wait for the image", true);
        return false;
    }
    report(snapshots_.add(*image).title + " taken: click it to show it as B");
    return true;
}

void Session::compare_with_snapshot(size_t index) {
    const Snapshot snapshot = snapshots_.all()[index];
    compare(snapshot.title, snapshot.levels);
    if (compared_ != snapshot.levels) return;
    Looks looks = history_.now();
    looks[1] = snapshot.look;
    history_.change(std::move(looks), "");
    after_change();
    report("B is " + snapshot.title + " as it was");
}

void Session::use_look_of_snapshot(size_t index) {
    const Snapshot& snapshot = snapshots_.all()[index];
    edit("", [&](Look& look) { look = snapshot.look; });
    report("the look is that of " + snapshot.title);
}

void Session::sort_rows_at(std::optional<std::array<int, 2>> pixel) {
    sorted_at_ = pixel;
    shares_.reset();
    if (pixel) pixel_shares();
}

const PixelShares* Session::pixel_shares() {
    const auto& image = images_[active_];
    if (!sorted_at_ || !image) return nullptr;
    const std::pair<uint64_t, Page> now = {image->version, page_};
    if (shares_ && shares_of_ == now) return &*shares_;
    const Levels& levels = *levels_of(active_);
    const int k = levels.reduction();
    shares_of_ = now;
    shares_ = shares_at(levels.stack(0), image->look, targets_of_page(),
                        {(*sorted_at_)[0] / k, (*sorted_at_)[1] / k},
                        [&](const Look& look) { return plan_for(active_, look); });
    shares_->pixel = *sorted_at_;
    return &*shares_;
}

/// False for an action that changes nothing of what is shown.
bool Session::perform_on_view(Action action) {
    switch (action) {
        case Action::ZoomFit:
            view_.fit();
            return true;
        case Action::ZoomOne:
            view_.set_scale(1);
            return true;
        case Action::ZoomIn:
            view_.set_scale(view_.scale() * zoom_step);
            return true;
        case Action::ZoomOut:
            view_.set_scale(view_.scale() / zoom_step);
            return true;
        case Action::ToggleWipe:
            is_wiping_ = !is_wiping_;
            return true;
        case Action::PreviousLayer:
            show_neighbor_layer(-1);
            return true;
        case Action::NextLayer:
            show_neighbor_layer(1);
            return true;
        case Action::PickMatte:
            is_picking_ = !is_picking_ && !picker_.layers().empty();
            if (picker_.layers().empty())
                report("no Cryptomatte in this file: nothing to pick", true);
            after_change();
            return true;
        case Action::FlagPixels: {
            ViewMode mode = mode_;
            mode.flags_pixels = !mode.flags_pixels;
            set_mode(std::move(mode));
            return true;
        }
        case Action::ShowStops:
        case Action::ShowSamples:
        case Action::ShowNoise: {
            const FalseColor wanted = action == Action::ShowStops     ? FalseColor::Stops
                                      : action == Action::ShowSamples ? FalseColor::Samples
                                                                      : FalseColor::Noise;
            ViewMode mode = mode_;
            mode.false_color = mode.false_color == wanted ? FalseColor::None : wanted;
            set_mode(std::move(mode));
            return true;
        }
        case Action::Denoise:
            is_denoising_ = !is_denoising_;
            return true;
        case Action::TakeSnapshot:
            take_snapshot();
            return true;
        case Action::Freeze:
            if (take_snapshot()) compare_with_snapshot(snapshots_.all().size() - 1);
            return true;
        case Action::SortByPixel:
            sort_rows_at(sorted_at_ ? std::nullopt : hovered_);
            report(sorted_at_ ? fmt::format("rows by their light at {}, {}; L: in order",
                                            (*sorted_at_)[0], (*sorted_at_)[1])
                              : std::string("rows in order"));
            return true;
        case Action::SwitchLook:
            active_ = 1 - active_;
            return true;
        default:
            return show_channel(action);
    }
}

}  // namespace velatura::compositor::window
