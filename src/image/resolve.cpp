// SPDX-License-Identifier: Apache-2.0
#include "image/resolve.h"

#include "base/tasks.h"
#include "image/names.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace velatura::image {

namespace {

constexpr uint32_t absent = AccumulatorTable::absent;
constexpr float largest_half = 65504.0f;

enum class Selection { All, HalfA, HalfB };

/// Below this part of what a difference is made from it is rounding.
constexpr double rounding_share = 0x1p-20;

/// Where a layer comes from: the sum of some accumulators, in this order, minus others.
struct LayerSource {
    LayerEntry entry;
    std::vector<uint32_t> plus, minus;
    bool is_clamped = false;   ///< without what clamps took of `plus`
    bool is_rest = false;      ///< of what came first: drops what is only rounding
    bool may_be_left_out = false;  ///< not stored when zero everywhere
};

using Planes = std::array<std::vector<float>, 3>;

/// What the even ones leave; exact zero stays exact zero.
Triple odd_samples(const Triple& all, const Triple& even) {
    return {all.x - even.x, all.y - even.y, all.z - even.z};
}

/// The sums of a tile's pixels; false where nothing came.
bool selected(const SampleSums& sums, size_t tile, uint32_t accumulator, Selection selection, TileTotals& totals) {
    const uint32_t half = selection == Selection::All ? absent : sums.table().half_of(accumulator);
    if (selection == Selection::HalfA) return sums.tile_totals(tile, half, totals);
    if (!sums.tile_totals(tile, accumulator, totals)) return false;
    TileTotals a;
    if (selection == Selection::HalfB && sums.tile_totals(tile, half, a))
        std::transform(totals.begin(), totals.end(), a.begin(), totals.begin(), odd_samples);
    return true;
}

void for_each_row(const Window& w, const std::function<void(int)>& body) {
    parallel_for(size_t(w.height()), [&](size_t row) { body(w.y0 + int(row)); });
}

/// Calls visit(pixel in the window, pixel in the tile).
template <class Visit>
void for_each_pixel(const SampleSums& sums, size_t tile, const Visit& visit) {
    const Window w = sums.tile_window(tile);
    for (int y = w.y0; y < w.y1; ++y) {
        const size_t begin = sums.window().index(w.x0, y), in_tile = size_t(y - w.y0) * size_t(SampleSums::tile_size);
        for (size_t i = 0; i < size_t(w.width()); ++i) visit(begin + i, in_tile + i);
    }
}

/// What the sums of every pixel are divided by.
std::vector<double> pixel_weights(const SampleSums& sums, Selection selection) {
    std::vector<double> weights(sums.window().pixel_count());
    parallel_for(sums.tile_count(), [&](size_t tile) {
        TileTotals coverage;
        if (!selected(sums, tile, AccumulatorTable::coverage, selection, coverage)) return;
        for_each_pixel(sums, tile, [&](size_t i, size_t k) { weights[i] = weight_of(coverage[k]); });
    });
    return weights;
}

void drop_rounding(Triple& rest, const Triple& whole) {
    const auto drop = [](double& r, double w) {
        if (std::abs(r) <= rounding_share * std::abs(w)) r = 0.0;
    };
    drop(rest.x, whole.x);
    drop(rest.y, whole.y);
    drop(rest.z, whole.z);
}

/// The mean of a layer in every pixel.
Planes layer_planes(const SampleSums& sums,
                    const std::vector<double>& weights,
                    const LayerSource& source,
                    Selection selection) {
    Planes planes;
    for (auto& plane : planes) plane.assign(weights.size(), 0.0f);
    parallel_for(sums.tile_count(), [&](size_t tile) {
        TileTotals sum{}, whole{}, part;
        bool is_lit = false;
        for (const uint32_t a : source.plus) {
            if (!selected(sums, tile, a, selection, part)) continue;
            for (size_t k = 0; k < sum.size(); ++k) sum[k] += part[k];
            is_lit = true;
        }
        if (source.is_rest) whole = sum;
        for (const uint32_t a : source.minus) {
            if (!selected(sums, tile, a, selection, part)) continue;
            for (size_t k = 0; k < sum.size(); ++k) sum[k] += {-part[k].x, -part[k].y, -part[k].z};
            is_lit = true;
        }
        if (!is_lit) return;
        if (source.is_rest) {
            for (size_t k = 0; k < sum.size(); ++k) drop_rounding(sum[k], whole[k]);
        }
        for_each_pixel(sums, tile, [&](size_t i, size_t k) {
            if (weights[i] == 0.0) return;
            planes[0][i] = float(sum[k].x / weights[i]);
            planes[1][i] = float(sum[k].y / weights[i]);
            planes[2][i] = float(sum[k].z / weights[i]);
        });
    });
    return planes;
}

struct Extent {
    float largest = 0.0f;
    bool is_finite = true;
    size_t bad_pixel = 0;
};

Extent extent_of(const Planes& planes) {
    Extent extent;
    for (const auto& plane : planes) {
        for (size_t i = 0; i < plane.size(); ++i) {
            if (!std::isfinite(plane[i])) {
                if (extent.is_finite) extent.bad_pixel = i;
                extent.is_finite = false;
            }
            extent.largest = std::max(extent.largest, std::abs(plane[i]));
        }
    }
    return extent;
}

/// Rounds to the stored precision.
Channel stored_channel(std::string name, std::vector<float> plane, ChannelType type) {
    Channel channel;
    channel.name = std::move(name);
    if (type == ChannelType::Half) {
        std::vector<Imath::half> half(plane.size());
        std::transform(plane.begin(), plane.end(), half.begin(),
                       [](float v) { return Imath::half(v); });
        channel.data = std::move(half);
    } else {
        channel.data = std::move(plane);
    }
    return channel;
}

class Resolver {
  public:
    explicit Resolver(const SampleSums& sums)
        : sums_(sums), set_(sums.layer_set()), table_(sums.table()), window_(sums.window()) {}

    ResolvedLayers run();

  private:
    std::vector<LayerSource> matrix_sources() const;
    std::vector<LayerSource> bounce_sources() const;
    std::vector<LayerSource> group_sources() const;
    std::vector<LayerSource> shadow_sources(bool unoccluded) const;
    std::vector<LayerSource> caster_sources(int g) const;
    uint32_t direct(int g) const;

    void store_beauty();
    void store_family(const std::string& family, std::vector<LayerSource> sources, bool is_in_sum);
    void store_halves(const Part& part, const std::vector<LayerSource>& sources);
    void store_casters();
    void store_clamp(const LayerSource& source, Planes whole_planes, Part& part);
    Planes mean_without_clamps(const LayerSource& source);
    bool store_layer(Part& part, LayerEntry entry, Planes planes, bool may_be_left_out, bool as_float = false);
    ChannelType store_channels(Part& part, const std::string& layer, Planes planes, bool as_float) const;
    void fold_family(const Part& part, FamilyClosure& closure);
    void store_data();
    void fail(size_t pixel, const std::string& what);

    Planes mean_of(LayerSource source, Selection selection) {
        std::vector<double>& weights = weights_[size_t(selection)];
        if (weights.empty()) weights = pixel_weights(sums_, selection);
        if (source.is_clamped) {
            for (const uint32_t a : source.plus) source.minus.push_back(table_.clamped(a));
        }
        return layer_planes(sums_, weights, source, selection);
    }

    const SampleSums& sums_;
    const LayerSet& set_;
    const AccumulatorTable& table_;
    const Window window_;
    ResolvedLayers out_;
    std::vector<Part> halves_;
    Part clamps_;
    std::vector<LayerSource> clamp_sources_;  ///< of the half images of `clamps_`
    std::array<std::vector<double>, 3> weights_;  ///< per Selection
};

std::string group_lpe(const std::string& events, const LayerSet& set, int group) {
    return fmt::format("{}<L.'{}'>", events, set.groups[size_t(group)].name);
}

std::string column_events(const LayerSet& set, int column) {
    if (column == 0) return "C";
    if (column > set.last_bounce) return fmt::format("C.{{{},}}", column);
    return column == 1 ? "C." : fmt::format("C.{{{}}}", column);
}

std::vector<LayerSource> Resolver::matrix_sources() const {
    std::vector<LayerSource> list;
    for (int c = 0; c < set_.bounce_count(); ++c) {
        for (int g = 0; g < set_.group_count(); ++g) {
            LayerSource s;
            s.entry.bounce = set_.column_name(c);
            s.entry.group = set_.groups[size_t(g)].name;
            s.entry.name = s.entry.bounce + "_" + s.entry.group;
            s.entry.lpe = group_lpe(column_events(set_, c), set_, g);
            s.plus = {table_.matrix(c, g)};
            s.may_be_left_out = true;
            list.push_back(std::move(s));
        }
    }
    return list;
}

std::vector<LayerSource> Resolver::bounce_sources() const {
    std::vector<LayerSource> list;
    for (int c = 0; c < set_.bounce_count(); ++c) {
        LayerSource s;
        s.entry.name = s.entry.bounce = set_.column_name(c);
        s.entry.lpe = column_events(set_, c) + "[LOB]";
        if (set_.matrix_layers) {
            for (int g = 0; g < set_.group_count(); ++g) s.plus.push_back(table_.matrix(c, g));
        } else {
            s.plus = {table_.bounce(c)};
        }
        list.push_back(std::move(s));
    }
    return list;
}

std::vector<LayerSource> Resolver::group_sources() const {
    std::vector<LayerSource> list;
    for (int g = 0; g < set_.group_count(); ++g) {
        LayerSource s;
        s.entry.group = set_.groups[size_t(g)].name;
        s.entry.name = "C_" + s.entry.group;
        s.entry.lpe = group_lpe("C.*", set_, g);
        if (set_.matrix_layers) {
            for (int c = 0; c < set_.bounce_count(); ++c) s.plus.push_back(table_.matrix(c, g));
        } else {
            s.plus = {table_.group(g)};
        }
        list.push_back(std::move(s));
    }
    return list;
}

/// What arrived of a group's direct light.
uint32_t Resolver::direct(int g) const {
    return table_.direct(g) != absent ? table_.direct(g) : table_.matrix(1, g);
}

/// Of one group, `rest` last.
std::vector<LayerSource> Resolver::caster_sources(int g) const {
    std::vector<LayerSource> list;
    LayerSource rest;
    rest.plus = {table_.unoccluded(g)};
    rest.minus = {direct(g)};
    rest.is_rest = true;
    for (uint32_t c = 0; c <= set_.casters.size(); ++c) {
        const bool is_named = c < set_.casters.size();
        LayerSource s = is_named ? LayerSource{} : rest;
        if (is_named) {
            s.plus = {table_.taken(g, c)};
            rest.minus.push_back(table_.taken(g, c));
        }
        s.entry.group = set_.groups[size_t(g)].name;
        s.entry.caster = is_named ? set_.casters[c].name : rest_caster;
        s.entry.bounce = "b1";
        s.entry.name = "S_" + s.entry.group + "_" + s.entry.caster;
        s.entry.lpe = group_lpe("shadow;C.", set_, g);
        s.may_be_left_out = true;
        list.push_back(std::move(s));
    }
    return list;
}

std::vector<LayerSource> Resolver::shadow_sources(bool unoccluded) const {
    std::vector<LayerSource> list;
    for (int g = 0; g < set_.group_count(); ++g) {
        LayerSource s;
        s.entry.group = set_.groups[size_t(g)].name;
        s.entry.bounce = "b1";
        s.entry.name = (unoccluded ? "U_" : "S_") + s.entry.group;
        s.entry.lpe = group_lpe(unoccluded ? "unoccluded;C." : "shadow;C.", set_, g);
        s.plus = {table_.unoccluded(g)};
        if (!unoccluded) s.minus = {direct(g)};
        s.may_be_left_out = true;
        list.push_back(std::move(s));
    }
    return list;
}

void Resolver::fail(size_t pixel, const std::string& what) {
    if (!out_.first_failure.empty()) return;
    const int x = window_.x0 + int(pixel % size_t(window_.width()));
    const int y = window_.y0 + int(pixel / size_t(window_.width()));
    out_.first_failure = fmt::format("pixel {},{}: {}", x, y, what);
}

void Resolver::store_beauty() {
    Part part;
    part.name = "rgba";
    std::vector<float> rgba = resolve_rgba(sums_);
    if (set_.has_clamp()) {
        LayerSource beauty;
        beauty.plus = {AccumulatorTable::beauty};
        beauty.is_clamped = true;
        const Planes planes = mean_of(beauty, Selection::All);
        for (size_t c = 0; c < 3; ++c) {
            for (size_t i = 0; i < planes[c].size(); ++i) rgba[4 * i + c] = planes[c][i];
        }
    }
    const char* names[] = {"R", "G", "B", "A"};
    for (size_t c = 0; c < 4; ++c) {
        Channel channel = Channel::make(names[c], ChannelType::Float, window_.pixel_count());
        auto& values = std::get<std::vector<float>>(channel.data);
        for (size_t i = 0; i < values.size(); ++i) {
            values[i] = rgba[4 * i + c];
            if (!std::isfinite(values[i]))
                fail(i, fmt::format("{} of the beauty is not finite", names[c]));
        }
        part.channels.push_back(std::move(channel));
    }
    LayerEntry entry;
    entry.name = "rgba";
    entry.family = "beauty";
    entry.part = "rgba";
    entry.type = "float";
    entry.lpe = "C.*[LOB]";
    out_.layers.push_back(entry);
    out_.image.parts.push_back(std::move(part));
}

/// Appends the channels of a layer, as half where that is wanted and none overflows. Returns their type.
ChannelType Resolver::store_channels(Part& part, const std::string& layer, Planes planes, bool as_float) const {
    const bool overflows = !(extent_of(planes).largest <= largest_half);
    const ChannelType type = as_float || set_.float_layers || overflows ? ChannelType::Float : ChannelType::Half;
    const char* names[] = {".R", ".G", ".B"};
    for (size_t c = 0; c < 3; ++c)
        part.channels.push_back(stored_channel(layer + names[c], std::move(planes[c]), type));
    return type;
}

bool Resolver::store_layer(Part& part, LayerEntry entry, Planes planes, bool may_be_left_out, bool as_float) {
    const Extent extent = extent_of(planes);
    if (!extent.is_finite)
        fail(extent.bad_pixel, fmt::format("layer {} is not finite", entry.name));
    entry.part = part.name;
    entry.is_empty = may_be_left_out && extent.largest == 0.0f && extent.is_finite;
    entry.type = set_.float_layers || as_float ? "float" : "half";
    const bool is_stored = !entry.is_empty;
    if (is_stored && store_channels(part, entry.name, std::move(planes), as_float) == ChannelType::Float) {
        if (entry.type == "half") out_.overflowed.push_back(entry.name);
        entry.type = "float";
    }
    out_.layers.push_back(std::move(entry));
    return is_stored;
}

void Resolver::fold_family(const Part& part, FamilyClosure& closure) {
    const bool has_half =
        std::any_of(part.channels.begin(), part.channels.end(),
                    [](const Channel& c) { return c.type() == ChannelType::Half; });
    set_bound(closure, closure.order.size(), has_half);
    Part& rgba = out_.image.parts[0];
    for (size_t c = 0; c < 3; ++c) {
        auto& beauty = std::get<std::vector<float>>(rgba.channels[c].data);
        std::vector<float> fold(window_.pixel_count(), 0.0f);
        std::vector<double> size(window_.pixel_count(), 0.0);
        for (size_t layer = 0; layer < closure.order.size(); ++layer) {
            const Channel& channel = part.channels[3 * layer + c];
            for_each_value(channel, [&fold, &size](size_t i, float v) {
                fold[i] += v;
                size[i] += std::abs(double(v));
            });
            // What clamps took was rounded, too
            if (const Channel* taken = clamps_.find("clamp_" + channel.name))
                for_each_value(*taken, [&size](size_t i, float v) { size[i] += std::abs(double(v)); });
        }
        for (int y = window_.y0; y < window_.y1; ++y) {
            for (int x = window_.x0; x < window_.x1; ++x) {
                const size_t i = window_.index(x, y);
                Triple b = sums_.total(x, y, AccumulatorTable::beauty);
                if (set_.has_clamp()) {
                    const Triple t = sums_.total(x, y, table_.clamped(AccumulatorTable::beauty));
                    b += {-t.x, -t.y, -t.z};
                }
                const double weight = weight_of(sums_.total(x, y, AccumulatorTable::coverage));
                const double mean = weight == 0.0 ? 0.0
                                                  : (c == 0   ? b.x
                                                     : c == 1 ? b.y
                                                              : b.z) /
                                                        weight;
                const double difference = std::abs(double(fold[i]) - mean);
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
}

void Resolver::store_family(const std::string& family,
                            std::vector<LayerSource> sources,
                            bool is_in_sum) {
    Part part;
    part.name = family;
    FamilyClosure closure;
    closure.family = family;
    closure.is_exact = out_.closure.empty();
    for (LayerSource& s : sources) {
        s.is_clamped = is_in_sum && set_.has_clamp();
        s.entry.family = family;
        s.entry.in_sum = is_in_sum && closure.is_exact;
        // Without clamps it may need more than a half has room for
        Planes whole = s.is_clamped ? mean_without_clamps(s) : Planes();
        const bool overflows = !(extent_of(whole).largest <= largest_half);
        const bool is_stored =
            store_layer(part, s.entry, mean_of(s, Selection::All), s.may_be_left_out, overflows);
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
void Resolver::store_halves(const Part& part, const std::vector<LayerSource>& sources) {
    if (!set_.halves) return;
    Part halves;
    halves.name = part.name + "_halves";
    for (const LayerSource& s : sources) {
        const bool is_stored = part.find(s.entry.name + ".R") != nullptr;
        if (!is_stored) continue;
        for (const Selection selection : {Selection::HalfA, Selection::HalfB}) {
            LayerEntry entry = s.entry;
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

/// S_<group> is the fold of what is stored by caster, so that the file alone shows that they add up.
void Resolver::store_casters() {
    Part shadows, casters;
    shadows.name = "shadow";
    casters.name = "caster";
    std::vector<LayerSource> all = shadow_sources(false);
    std::vector<LayerSource> every_caster;
    for (int g = 0; g < set_.group_count(); ++g) {
        Planes fold;
        for (auto& plane : fold) plane.assign(window_.pixel_count(), 0.0f);
        for (LayerSource& s : caster_sources(g)) {
            s.entry.family = casters.name;
            if (!store_layer(casters, s.entry, mean_of(s, Selection::All), s.may_be_left_out)) continue;
            for (size_t c = 0; c < 3; ++c) {
                const Channel& channel = casters.channels[casters.channels.size() - 3 + c];
                for_each_value(channel, [&](size_t i, float v) { fold[c][i] += v; });
            }
            every_caster.push_back(std::move(s));
        }
        LayerSource& s = all[size_t(g)];
        s.entry.family = shadows.name;
        store_layer(shadows, s.entry, std::move(fold), s.may_be_left_out, true);
    }
    store_halves(shadows, all);
    store_halves(casters, every_caster);
    for (Part* part : {&shadows, &casters})
        if (!part->channels.empty()) out_.image.parts.push_back(std::move(*part));
}

Planes Resolver::mean_without_clamps(const LayerSource& source) {
    LayerSource whole = source;
    whole.is_clamped = false;
    return mean_of(whole, Selection::All);
}

/// What the clamps took of a stored layer, if they took anything.
void Resolver::store_clamp(const LayerSource& source, Planes whole_planes, Part& part) {
    const bool is_touched = std::any_of(source.plus.begin(), source.plus.end(), [this](uint32_t a) { return sums_.is_used(table_.clamped(a)); });
    if (!is_touched) return;
    // Rounded as a render without clamps would store it
    Part room;
    store_channels(room, source.entry.name, std::move(whole_planes), false);
    Planes taken;
    for (size_t c = 0; c < 3; ++c) {
        Channel& kept = part.channels[part.channels.size() - 3 + c];
        auto* const floats = std::get_if<std::vector<float>>(&kept.data);
        taken[c].resize(window_.pixel_count());
        for (size_t i = 0; i < taken[c].size(); ++i) {
            const CutValue value = undoable_cut(room.channels[c].value(i), kept.value(i));
            taken[c][i] = value.taken;
            if (floats) (*floats)[i] = value.cut;
        }
    }
    LayerEntry entry = source.entry;
    entry.name = "clamp_" + source.entry.name;
    entry.of = source.entry.name;
    entry.family = "clamp";
    entry.lpe.clear();
    entry.in_sum = false;
    LayerSource halved;
    halved.entry = entry;
    for (const uint32_t a : source.plus) halved.plus.push_back(table_.clamped(a));
    store_layer(clamps_, std::move(entry), std::move(taken), false, true);
    clamp_sources_.push_back(std::move(halved));
}

void Resolver::store_data() {
    Part part;
    part.name = "data";
    part.attributes["colorInteropID"] = std::string("data");
    const size_t pixels = window_.pixel_count();
    const auto add = [&](const char* layer, std::initializer_list<const char*> suffixes,
                         ChannelType type) {
        LayerEntry entry;
        entry.name = layer;
        entry.family = "data";
        entry.part = part.name;
        entry.type = type == ChannelType::Uint ? "uint" : "float";
        out_.layers.push_back(entry);
        const size_t first = part.channels.size();
        for (const char* suffix : suffixes) {
            part.channels.push_back(Channel::make(std::string(layer) + suffix, type, pixels));
        }
        return first;
    };
    const size_t albedo = add("albedo", {".R", ".G", ".B"}, ChannelType::Float);
    const size_t normal = add("N", {".X", ".Y", ".Z"}, ChannelType::Float);
    const size_t position = add("P", {".X", ".Y", ".Z"}, ChannelType::Float);
    const size_t depth = add("Z", {""}, ChannelType::Float);
    const size_t st = add("st", {".U", ".V"}, ChannelType::Float);
    const size_t prim = add("primId", {""}, ChannelType::Uint);
    const size_t instance = add("instanceId", {""}, ChannelType::Uint);
    const size_t count = add("sampleCount", {""}, ChannelType::Uint);
    const size_t variance = add("variance", {""}, ChannelType::Float);
    const size_t invalid = add("invalid", {""}, ChannelType::Uint);

    const auto set_float = [&part](size_t channel, size_t i, double sum, double weight) {
        std::get<std::vector<float>>(part.channels[channel].data)[i] =
            weight == 0.0 ? 0.0f : float(sum / weight);
    };
    const auto set_triple = [&set_float](size_t first, size_t i, const Triple& sum, double weight) {
        set_float(first, i, sum.x, weight);
        set_float(first + 1, i, sum.y, weight);
        set_float(first + 2, i, sum.z, weight);
    };
    const auto set_uint = [&part](size_t channel, size_t i, uint32_t v) {
        std::get<std::vector<uint32_t>>(part.channels[channel].data)[i] = v;
    };
    for_each_row(window_, [&](int y) {
        for (int x = window_.x0; x < window_.x1; ++x) {
            const size_t i = window_.index(x, y);
            const Triple coverage = sums_.total(x, y, AccumulatorTable::coverage);
            const double all = weight_of(coverage);
            // Colour and normal blend with nothing at silhouettes; positions are means over what
            // was hit
            const double hit = weight_of(sums_.total(x, y, table_.hits()));
            set_triple(albedo, i, sums_.total(x, y, table_.albedo()), all);
            set_triple(normal, i, sums_.total(x, y, table_.normal()), all);
            set_triple(position, i, sums_.total(x, y, table_.position()), hit);
            const Triple surface = sums_.total(x, y, table_.surface());
            set_float(st, i, surface.x, hit);
            set_float(st + 1, i, surface.y, hit);
            set_float(depth, i, surface.z, hit);
            const PixelRecord& record = sums_.record(x, y);
            set_uint(prim, i, record.prim_id);
            set_uint(instance, i, record.instance_id);
            set_uint(count, i, uint32_t(coverage.z));
            set_uint(invalid, i, record.invalid);
            const PixelHalves h = resolve_halves(sums_, x, y, AccumulatorTable::beauty);
            set_float(variance, i, h.variance[0] + h.variance[1] + h.variance[2], 3.0);
        }
    });
    out_.image.parts.push_back(std::move(part));
}

ResolvedLayers Resolver::run() {
    out_.image.data = out_.image.display = window_;
    store_beauty();
    if (set_.matrix_layers) store_family("matrix", matrix_sources(), true);
    if (set_.bounce_layers) store_family("bounces", bounce_sources(), true);
    if (set_.group_layers) store_family("groups", group_sources(), true);
    if (set_.shadow_layers) {
        store_family("unoccluded", shadow_sources(true), false);
        if (set_.caster_layers)
            store_casters();
        else
            store_family("shadow", shadow_sources(false), false);
    }
    clamps_.name = "clamp";
    store_halves(clamps_, clamp_sources_);
    if (!clamps_.channels.empty()) out_.image.parts.push_back(std::move(clamps_));
    if (set_.data_layers) store_data();
    if (set_.halves) {
        LayerSource beauty;
        beauty.plus = {AccumulatorTable::beauty};
        beauty.is_clamped = set_.has_clamp();
        beauty.entry.family = "halves";
        beauty.entry.of = "rgba";
        Part part;
        part.name = "rgba_halves";
        for (const Selection selection : {Selection::HalfA, Selection::HalfB}) {
            beauty.entry.name = selection == Selection::HalfA ? "beauty_hA" : "beauty_hB";
            store_layer(part, beauty.entry, mean_of(beauty, selection), false);
        }
        out_.image.parts.push_back(std::move(part));
        for (Part& p : halves_) out_.image.parts.push_back(std::move(p));
    }
    return std::move(out_);
}

}  // namespace

CutValue undoable_cut(float whole, float cut) {
    const float taken = whole - cut;
    if (cut + taken == whole) return {cut, taken};
    // The difference was rounded, so that it is more than half of the whole: this one is not (Sterbenz 1974)
    return {whole - taken, taken};
}

double clamped_share(const SampleSums& sums) {
    if (!sums.layer_set().has_clamp()) return 0.0;
    const uint32_t clamped = sums.table().clamped(AccumulatorTable::beauty);
    double all = 0, taken = 0;
    const Window& w = sums.window();
    for (int y = w.y0; y < w.y1; ++y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const double weight = weight_of(sums.total(x, y, AccumulatorTable::coverage));
            if (weight == 0.0) continue;
            const Triple whole = sums.total(x, y, AccumulatorTable::beauty), t = sums.total(x, y, clamped);
            all += (whole.x + whole.y + whole.z) / weight;
            taken += (t.x + t.y + t.z) / weight;
        }
    }
    return all > 0.0 ? taken / all : 0.0;
}

double weight_of(const Triple& coverage) {
    const double weight = coverage.y, count = coverage.z;
    return std::abs(weight) < 0.1 * count ? count : weight;
}

PixelHalves resolve_halves(const SampleSums& sums, int x, int y, uint32_t accumulator) {
    PixelHalves result;
    const Triple coverage = sums.total(x, y, AccumulatorTable::coverage);
    const AccumulatorTable& table = sums.table();
    const Triple coverage_a = sums.total(x, y, table.half_of(AccumulatorTable::coverage));
    const Triple coverage_b = odd_samples(coverage, coverage_a);
    const Triple all = sums.total(x, y, accumulator);
    const Triple a = sums.total(x, y, table.half_of(accumulator)), b = odd_samples(all, a);
    const auto mean = [](const Triple& sum, const Triple& c) {
        const double w = weight_of(c);
        return w == 0.0 ? std::array<double, 3>{}
                        : std::array<double, 3>{sum.x / w, sum.y / w, sum.z / w};
    };
    result.mean = mean(all, coverage);
    result.a = mean(a, coverage_a);
    result.b = mean(b, coverage_b);
    result.is_known = coverage_a.z > 0 && coverage_b.z > 0;
    if (!result.is_known) return result;
    // Var(A − B) = s²/nA + s²/nB and Var(mean) = s²/(nA + nB); for equal halves the factor is 1/4
    const double factor = coverage_a.z * coverage_b.z / (coverage.z * coverage.z);
    for (size_t c = 0; c < 3; ++c) {
        const double difference = result.a[c] - result.b[c];
        result.variance[c] = difference * difference * factor;
    }
    return result;
}

std::vector<float> resolve_rgba(const SampleSums& sums) {
    const Window& w = sums.window();
    std::vector<float> rgba(4 * w.pixel_count(), 0.0f);
    for_each_row(w, [&](int y) {
        for (int x = w.x0; x < w.x1; ++x) {
            const Triple coverage = sums.total(x, y, AccumulatorTable::coverage);
            const double weight = weight_of(coverage);
            if (weight == 0.0) continue;
            const Triple sum = sums.total(x, y, AccumulatorTable::beauty);
            float* out = &rgba[4 * w.index(x, y)];
            out[0] = float(sum.x / weight);
            out[1] = float(sum.y / weight);
            out[2] = float(sum.z / weight);
            out[3] = float(coverage.x / weight);
        }
    });
    return rgba;
}

void set_bound(FamilyClosure& closure, size_t count, bool has_half) {
    // One rounding to storage per layer, then count roundings of the fold and one of the mean to
    // float
    const auto n = double(count);
    closure.relative = (has_half ? 0x1p-11 : 0x1p-24) + (n + 2.0) * 0x1p-23;
    closure.absolute = (n + 1.0) * (has_half ? 0x1p-25 : 0x1p-149);
}

ResolvedLayers resolve_layers(const SampleSums& sums) {
    return Resolver(sums).run();
}

}  // namespace velatura::image
