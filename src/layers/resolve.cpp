// SPDX-License-Identifier: Apache-2.0
#include "layers/resolve.h"

#include "accumulate/layer_sources.h"
#include "accumulate/pixel_means.h"
#include "layers/data_layers.h"
#include "layers/layer_planes.h"
#include "statistics/relative_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace velatura::layers {

namespace {

constexpr float largest_half = 65504.0f;

void store_channels(image::Part& part,
                    const std::string& layer,
                    Planes planes,
                    image::ChannelType type) {
    const char* names[] = {".R", ".G", ".B"};
    for (size_t c = 0; c < 3; ++c)
        part.channels.push_back(stored_channel(layer + names[c], std::move(planes[c]), type));
}

class Resolver {
  public:
    explicit Resolver(const accumulate::SampleSums& sums)
        : sums_(sums), set_(sums.layer_set()), table_(sums.table()), window_(sums.window()) {}

    ResolvedLayers run();

  private:
    void store_beauty();
    void store_family(const std::string& family,
                      std::vector<accumulate::LayerSource> sources,
                      bool is_in_sum);
    void store_halves(const image::Part& part, const std::vector<accumulate::LayerSource>& sources);
    void store_casters();
    void store_clamp(const accumulate::LayerSource& source, Planes whole_planes, image::Part& part);
    Planes mean_without_clamps(const accumulate::LayerSource& source);
    bool store_layer(image::Part& part,
                     accumulate::LayerEntry entry,
                     Planes planes,
                     bool can_be_omitted,
                     bool as_float = false);
    image::ChannelType stored_type(const Extent& extent, bool as_float) const;
    void store_beauty_aliases();
    void fold_family(const image::Part& part, FamilyClosure& closure);
    void fail(size_t pixel, const std::string& what);

    Planes mean_of(accumulate::LayerSource source, Selection selection) {
        std::vector<double>& weights = weights_[size_t(selection)];
        if (weights.empty()) weights = pixel_weights(sums_, selection);
        if (source.is_clamped) {
            for (const uint32_t a : source.plus) source.minus.push_back(table_.clamped(a));
        }
        return layer_planes(sums_, weights, source, selection);
    }

    const accumulate::SampleSums& sums_;
    const accumulate::LayerSet& set_;
    const accumulate::AccumulatorTable& table_;
    const image::Window window_;
    ResolvedLayers out_;
    std::vector<image::Part> halves_;
    image::Part clamps_;
    std::vector<accumulate::LayerSource> clamp_sources_;  ///< of the half images of `clamps_`
    std::array<std::vector<double>, 3> weights_;          ///< per Selection
};

void Resolver::fail(size_t pixel, const std::string& what) {
    if (!out_.first_failure.empty()) return;
    const int x = window_.x0 + int(pixel % size_t(window_.width()));
    const int y = window_.y0 + int(pixel / size_t(window_.width()));
    out_.first_failure = fmt::format("pixel {},{}: {}", x, y, what);
}

void Resolver::store_beauty() {
    image::Part part;
    part.name = "rgba";
    std::vector<float> rgba = accumulate::resolve_rgba(sums_);
    if (set_.has_clamp()) {
        accumulate::LayerSource beauty;
        beauty.plus = {accumulate::AccumulatorTable::beauty};
        beauty.is_clamped = true;
        const Planes planes = mean_of(beauty, Selection::All);
        for (size_t c = 0; c < 3; ++c) {
            for (size_t i = 0; i < planes[c].size(); ++i) rgba[4 * i + c] = planes[c][i];
        }
    }
    const char* names[] = {"R", "G", "B", "A"};
    for (size_t c = 0; c < 4; ++c) {
        image::Channel channel =
            image::Channel::make(names[c], image::ChannelType::Float, window_.pixel_count());
        auto& values = std::get<std::vector<float>>(channel.data);
        for (size_t i = 0; i < values.size(); ++i) {
            values[i] = rgba[4 * i + c];
            if (!std::isfinite(values[i]))
                fail(i, fmt::format("{} of the beauty is not finite", names[c]));
        }
        part.channels.push_back(std::move(channel));
    }
    accumulate::LayerEntry entry;
    entry.name = "rgba";
    entry.family = "beauty";
    entry.part = "rgba";
    entry.type = "float";
    entry.lpe = "C.*[LOB]";
    out_.layers.push_back(entry);
    out_.image.parts.push_back(std::move(part));
}

/// Half where that is wanted and none overflows.
image::ChannelType Resolver::stored_type(const Extent& extent, bool as_float) const {
    const bool overflows = !(extent.largest <= largest_half);
    return as_float || set_.float_layers || overflows ? image::ChannelType::Float
                                                      : image::ChannelType::Half;
}

bool Resolver::store_layer(image::Part& part,
                           accumulate::LayerEntry entry,
                           Planes planes,
                           bool can_be_omitted,
                           bool as_float) {
    const Extent extent = extent_of(planes);
    if (!extent.is_finite)
        fail(extent.bad_pixel, fmt::format("layer {} is not finite", entry.name));
    entry.part = part.name;
    entry.is_empty = can_be_omitted && extent.largest == 0.0f && extent.is_finite;
    entry.type = set_.float_layers || as_float ? "float" : "half";
    const bool is_stored = !entry.is_empty;
    if (is_stored) {
        const image::ChannelType type = stored_type(extent, as_float);
        store_channels(part, entry.name, std::move(planes), type);
        if (type == image::ChannelType::Float && entry.type == "half") {
            out_.overflowed.push_back(entry.name);
            entry.type = "float";
        }
    }
    out_.layers.push_back(std::move(entry));
    return is_stored;
}

/// The beauty, or its alpha, once more under the names that render vars have for them.
void Resolver::store_beauty_aliases() {
    image::Part& rgba = out_.image.parts[0];
    for (const accumulate::DataAlias& alias : set_.data_aliases) {
        const bool is_alpha = alias.of == "alpha";
        if (!is_alpha && alias.of != "beauty") continue;
        for (const char* name : {"R", "G", "B", "A"}) {
            if (is_alpha && std::string_view(name) != "A") continue;
            image::Channel copy = *rgba.find(name);
            copy.name = is_alpha ? alias.name : fmt::format("{}.{}", alias.name, name);
            rgba.channels.push_back(std::move(copy));
        }
        accumulate::LayerEntry entry;
        entry.name = alias.name;
        entry.family = "data";
        entry.part = rgba.name;
        entry.type = "float";
        out_.layers.push_back(entry);
    }
}

void Resolver::fold_family(const image::Part& part, FamilyClosure& closure) {
    const bool has_half =
        std::any_of(part.channels.begin(), part.channels.end(),
                    [](const image::Channel& c) { return c.type() == image::ChannelType::Half; });
    set_bound(closure, closure.order.size(), has_half);
    image::Part& rgba = out_.image.parts[0];
    double rounding = 0;
    for (size_t c = 0; c < 3; ++c) {
        auto& beauty = std::get<std::vector<float>>(rgba.channels[c].data);
        std::vector<float> fold(window_.pixel_count(), 0.0f);
        std::vector<double> size(window_.pixel_count(), 0.0);
        for (size_t layer = 0; layer < closure.order.size(); ++layer) {
            const image::Channel& channel = part.channels[3 * layer + c];
            image::for_each_value(channel, [&fold, &size](size_t i, float v) {
                fold[i] += v;
                size[i] += std::abs(double(v));
            });
            // What clamps took was rounded, too
            if (const image::Channel* taken = clamps_.find("clamp_" + channel.name))
                image::for_each_value(
                    *taken, [&size](size_t i, float v) { size[i] += std::abs(double(v)); });
        }
        for (int y = window_.y0; y < window_.y1; ++y) {
            for (int x = window_.x0; x < window_.x1; ++x) {
                const size_t i = window_.index(x, y);
                accumulate::Triple b = sums_.total(x, y, accumulate::AccumulatorTable::beauty);
                if (set_.has_clamp()) {
                    const accumulate::Triple t =
                        sums_.total(x, y, table_.clamped(accumulate::AccumulatorTable::beauty));
                    b += {-t.x, -t.y, -t.z};
                }
                const double weight = accumulate::weight_of(
                    sums_.total(x, y, accumulate::AccumulatorTable::coverage));
                const double mean = weight == 0.0 ? 0.0
                                                  : (c == 0   ? b.x
                                                     : c == 1 ? b.y
                                                              : b.z) /
                                                        weight;
                const double difference = std::abs(double(fold[i]) - mean);
                rounding += statistics::relative_square(difference * difference, mean);
                const double bound = closure.relative * size[i] + closure.absolute;
                closure.measured = std::max(closure.measured, difference / bound);
                closure.measured_absolute = std::max(closure.measured_absolute, difference);
                if (!(difference <= bound)) {
                    fail(i, fmt::format("the {} layers add up to {}, the independent beauty is {}",
                                        closure.family, fold[i], mean));
                }
            }
        }
        // The finest family defines the beauty
        if (closure.is_exact) beauty = std::move(fold);
    }
    if (closure.is_exact)
        out_.storage_error = std::sqrt(rounding / (3.0 * double(window_.pixel_count())));
}

void Resolver::store_family(const std::string& family,
                            std::vector<accumulate::LayerSource> sources,
                            bool is_in_sum) {
    image::Part part;
    part.name = family;
    FamilyClosure closure;
    closure.family = family;
    closure.is_exact = out_.closure.empty();
    for (accumulate::LayerSource& s : sources) {
        s.entry.family = family;
        s.entry.in_sum = is_in_sum && closure.is_exact;
        // Without clamps it may need more than a half has room for
        Planes whole = s.is_clamped ? mean_without_clamps(s) : Planes();
        const bool overflows = !(extent_of(whole).largest <= largest_half);
        const bool is_stored =
            store_layer(part, s.entry, mean_of(s, Selection::All), s.can_be_omitted, overflows);
        if (!is_stored) continue;
        closure.order.push_back(s.entry.name);
        if (s.is_clamped) store_clamp(s, std::move(whole), part);
    }
    if (is_in_sum) {
        fold_family(part, closure);
        out_.closure.push_back(std::move(closure));
    }
    store_halves(part, sources);
    if (!part.channels.empty()) out_.image.parts.push_back(std::move(part));
}

/// Of the layers that are stored in the part.
void Resolver::store_halves(const image::Part& part,
                            const std::vector<accumulate::LayerSource>& sources) {
    if (!set_.halves) return;
    image::Part halves;
    halves.name = part.name + "_halves";
    for (const accumulate::LayerSource& s : sources) {
        const bool is_stored = part.find(s.entry.name + ".R") != nullptr;
        if (!is_stored) continue;
        for (const Selection selection : {Selection::HalfA, Selection::HalfB}) {
            accumulate::LayerEntry entry = s.entry;
            entry.of = entry.name;
            entry.name += selection == Selection::HalfA ? "_hA" : "_hB";
            entry.family = "halves";
            entry.lpe.clear();
            entry.in_sum = false;
            store_layer(halves, entry, mean_of(s, selection), false);
        }
    }
    if (!halves.channels.empty()) halves_.push_back(std::move(halves));
}

/// S_<group> is the fold of what is stored by caster, so that the file alone shows that they add
/// up.
void Resolver::store_casters() {
    image::Part shadows, casters;
    shadows.name = "shadow";
    casters.name = "caster";
    std::vector<accumulate::LayerSource> all = accumulate::shadow_sources(set_, table_, false);
    std::vector<accumulate::LayerSource> every_caster;
    for (int g = 0; g < set_.group_count(); ++g) {
        Planes fold;
        for (auto& plane : fold) plane.assign(window_.pixel_count(), 0.0f);
        for (accumulate::LayerSource& s : accumulate::caster_sources(set_, table_, g)) {
            s.entry.family = casters.name;
            if (!store_layer(casters, s.entry, mean_of(s, Selection::All), s.can_be_omitted))
                continue;
            for (size_t c = 0; c < 3; ++c) {
                const image::Channel& channel = casters.channels[casters.channels.size() - 3 + c];
                image::for_each_value(channel, [&](size_t i, float v) { fold[c][i] += v; });
            }
            every_caster.push_back(std::move(s));
        }
        accumulate::LayerSource& s = all[size_t(g)];
        s.entry.family = shadows.name;
        store_layer(shadows, s.entry, std::move(fold), s.can_be_omitted, true);
    }
    store_halves(shadows, all);
    store_halves(casters, every_caster);
    for (image::Part* part : {&shadows, &casters})
        if (!part->channels.empty()) out_.image.parts.push_back(std::move(*part));
}

Planes Resolver::mean_without_clamps(const accumulate::LayerSource& source) {
    accumulate::LayerSource whole = source;
    whole.is_clamped = false;
    return mean_of(whole, Selection::All);
}

/// What the clamps took of a stored layer, if they took anything.
void Resolver::store_clamp(const accumulate::LayerSource& source,
                           Planes whole_planes,
                           image::Part& part) {
    const bool is_touched = std::any_of(source.plus.begin(), source.plus.end(), [this](uint32_t a) {
        return sums_.is_used(table_.clamped(a));
    });
    if (!is_touched) return;
    // Rounded as a render without clamps would store it
    image::Part scratch;
    const image::ChannelType type = stored_type(extent_of(whole_planes), false);
    store_channels(scratch, source.entry.name, std::move(whole_planes), type);
    Planes taken;
    for (size_t c = 0; c < 3; ++c) {
        image::Channel& kept = part.channels[part.channels.size() - 3 + c];
        auto* const floats = std::get_if<std::vector<float>>(&kept.data);
        taken[c].resize(window_.pixel_count());
        for (size_t i = 0; i < taken[c].size(); ++i) {
            const ClampedValue value = undoable_cut(scratch.channels[c].value(i), kept.value(i));
            taken[c][i] = value.taken;
            if (floats) (*floats)[i] = value.cut;
        }
    }
    accumulate::LayerEntry entry = source.entry;
    entry.name = "clamp_" + source.entry.name;
    entry.of = source.entry.name;
    entry.family = "clamp";
    entry.lpe.clear();
    entry.in_sum = false;
    accumulate::LayerSource halved;
    halved.entry = entry;
    for (const uint32_t a : source.plus) halved.plus.push_back(table_.clamped(a));
    store_layer(clamps_, std::move(entry), std::move(taken), false, true);
    clamp_sources_.push_back(std::move(halved));
}

ResolvedLayers Resolver::run() {
    out_.image.data = out_.image.display = window_;
    store_beauty();
    if (set_.has_lobe_matrix())
        store_family(accumulate::lobe_matrix_family, accumulate::lobe_matrix_sources(set_, table_),
                     true);
    if (set_.matrix_layers) store_family("matrix", accumulate::matrix_sources(set_, table_), true);
    if (set_.bounce_layers) store_family("bounces", accumulate::bounce_sources(set_, table_), true);
    if (set_.group_layers) store_family("groups", accumulate::group_sources(set_, table_), true);
    if (set_.has_paths("lobes"))
        store_family("lobes", accumulate::path_sources(set_, table_, "lobes"), true);
    if (set_.has_paths("paths"))
        store_family("paths", accumulate::path_sources(set_, table_, "paths"), false);
    if (set_.shadow_layers) {
        store_family("unoccluded", accumulate::shadow_sources(set_, table_, true), false);
        if (set_.caster_layers)
            store_casters();
        else
            store_family("shadow", accumulate::shadow_sources(set_, table_, false), false);
    }
    clamps_.name = "clamp";
    store_halves(clamps_, clamp_sources_);
    if (!clamps_.channels.empty()) out_.image.parts.push_back(std::move(clamps_));
    store_beauty_aliases();
    if (set_.has_data()) out_.image.parts.push_back(data_part(sums_, out_.layers));
    if (set_.halves) {
        accumulate::LayerSource beauty;
        beauty.plus = {accumulate::AccumulatorTable::beauty};
        beauty.is_clamped = set_.has_clamp();
        beauty.entry.family = "halves";
        beauty.entry.of = "rgba";
        image::Part part;
        part.name = "rgba_halves";
        for (const Selection selection : {Selection::HalfA, Selection::HalfB}) {
            beauty.entry.name = selection == Selection::HalfA ? "beauty_hA" : "beauty_hB";
            store_layer(part, beauty.entry, mean_of(beauty, selection), false);
        }
        out_.image.parts.push_back(std::move(part));
        for (image::Part& p : halves_) out_.image.parts.push_back(std::move(p));
    }
    return std::move(out_);
}

}  // namespace

ClampedValue undoable_cut(float whole, float cut) {
    const float taken = whole - cut;
    if (cut + taken == whole) return {cut, taken};
    // The difference was rounded, so that it is more than half of the whole: this one is not
    // (Sterbenz 1974)
    return {whole - taken, taken};
}

void set_bound(FamilyClosure& closure, size_t count, bool has_half) {
    // One rounding to storage per layer, then count roundings of the fold and one of the mean to
    // float
    const auto n = double(count);
    closure.relative = (has_half ? 0x1p-11 : 0x1p-24) + (n + 2.0) * 0x1p-23;
    closure.absolute = (n + 1.0) * (has_half ? 0x1p-25 : 0x1p-149);
}

ResolvedLayers resolve_layers(const accumulate::SampleSums& sums) {
    return Resolver(sums).run();
}

}  // namespace velatura::layers
