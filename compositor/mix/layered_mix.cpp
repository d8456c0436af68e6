// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/layered_mix.h"

#include "base/tasks.h"
#include "base/unique_names.h"
#include "compositor/io/file_attributes.h"
#include "compositor/io/row_values.h"
#include "compositor/io/stereo_views.h"
#include "image/digest.h"
#include "layers/cryptomatte.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace velatura::compositor::mix {

namespace {

using accumulate::LayerEntry;
using image::Channel;
using image::ChannelType;
using Values = std::vector<float>;
constexpr std::array<const char*, 3> rgb_names = {"R", "G", "B"};

/// Of a layer of our own, or of a half image of it.
std::string full_name(const std::string& layer, const std::string& half) {
    return layer == "rgba" && !half.empty() ? "beauty" + half : layer + half;
}

Values floats_of(const Channel& channel) {
    Values values(channel.size());
    image::for_each_value(channel, [&](size_t i, float v) { values[i] = v; });
    return values;
}

bool fits_half(const Channel& channel) {
    const auto* values = std::get_if<Values>(&channel.data);
    return values && std::all_of(values->begin(), values->end(),
                                 [](float v) { return float(Imath::half(v)) == v; });
}

void make_half(Channel& channel) {
    const auto& values = std::get<Values>(channel.data);
    std::vector<Imath::half> halves(values.size());
    for (size_t i = 0; i < values.size(); ++i) halves[i] = Imath::half(values[i]);
    channel.data = std::move(halves);
}

/// Those that still hold where the IDs are kept: with their manifests.
image::Attributes carried_with_ids(const image::Attributes& attributes) {
    image::Attributes carried = layers::carried_attributes(attributes);
    for (const auto& [name, attribute] : attributes) {
        const auto* other = std::get_if<image::OtherAttribute>(&attribute);
        if (name.starts_with("cryptomatte/") || (other && other->type == "idmanifest"))
            carried[name] = attribute;
    }
    return carried;
}

/// Manifests that lie in files beside the image become part of the header: the mix may be written
/// elsewhere.
void embed_manifests(const std::vector<layers::Cryptomatte>& mattes,
                     image::Attributes& attributes) {
    const image::Attributes before = attributes;
    for (const auto& [name, attribute] : before) {
        constexpr std::string_view ending = "/manif_file";
        if (!name.starts_with("cryptomatte/") || !name.ends_with(ending)) continue;
        const std::string stem = name.substr(0, name.size() - ending.size());
        const auto layer = before.find(stem + "/name");
        for (const layers::Cryptomatte& matte : mattes) {
            const bool is_it = layer != before.end() && !matte.names.empty() &&
                               layer->second == image::Attribute(matte.layer);
            if (!is_it) continue;
            image::Attributes described;
            layers::describe_cryptomatte(matte, described);
            for (const auto& [key, value] : described)
                if (key.ends_with("/manifest")) attributes[stem + "/manifest"] = value;
            attributes.erase(name);
        }
    }
}

}  // namespace

LayeredMix::LayeredMix(const LayerStack& layout, const MixPlan& plan, const Look& look)
    : layout_(layout),
      plan_(plan),
      look_(look),
      exposure_(std::exp2(look.exposure_stops)),
      outcomes_(layer_outcomes(layout, plan, exposure_)),
      terms_(plan.terms) {
    const auto& layers = layout.header().layers;
    const bool has_halves = std::any_of(layers.begin(), layers.end(),
                                        [](const LayerEntry& e) { return e.family == "halves"; });
    if (has_halves) halves_ = {"", "_hA", "_hB"};
    add_parts();
    if (layout.is_plain()) return;
    add_black_layers();
    add_beauty();
}

std::string LayeredMix::layer_of(const layers::ChannelRef& place) const {
    const std::string& name = layout_.image().parts[place.part].channels[place.channel].name;
    if (!layout_.is_plain()) return name.substr(0, name.find('.'));
    const auto at = foreign_layers_.find({place.part, place.channel});
    return at == foreign_layers_.end() ? std::string() : at->second;
}

/// Layers of a file of another renderer by their channels: those of the view that is mixed.
void LayeredMix::find_foreign_layers() {
    for (const LayerEntry& e : layout_.header().layers) {
        std::vector<layers::ChannelRef> places;
        if (e.family == "data") places = layout_.data_channels(e.name);
        for (size_t c = 0; c < 4; ++c)
            if (const auto place = layout_.place(e.name, c)) places.push_back(*place);
        for (const layers::ChannelRef& place : places)
            foreign_layers_.try_emplace({place.part, place.channel}, e.name);
    }
}

/// Of files that were opened together: what stands for the file's name becomes its part's.
void LayeredMix::name_part(size_t from, image::Part& part) const {
    for (const LayerEntry& e : layout_.header().layers) {
        const auto red = layout_.place(e.name, 0);
        if (e.family == "data" || !red || red->part != from) continue;
        const std::string& channel = layout_.image().parts[from].channels[red->channel].name;
        if (channel.find('.') == std::string::npos) part.name = e.name;
    }
}

/// The parts of the file with what is stored of them; what is computed later has no values yet.
void LayeredMix::add_parts() {
    const image::Image& file = layout_.image();
    out_.data = file.data;
    out_.display = file.display;
    out_.pixel_aspect_ratio = file.pixel_aspect_ratio;
    const auto mattes = layers::cryptomattes_of(file, layout_.path());
    const bool is_together =
        layout_.is_plain() && layout_.path().empty() && layout_.image().parts.size() > 1;
    const auto views = StereoViews::of(file, layout_.view());
    UniqueNames names;
    if (layout_.is_plain()) find_foreign_layers();
    for (size_t p = 0; p < file.parts.size(); ++p) {
        image::Part part;
        part.name = file.parts[p].name;
        if (is_together) name_part(p, part);
        if (!layout_.view().empty()) part.name = views->part_name(file.parts[p]);
        part.attributes = carried_with_ids(file.parts[p].attributes);
        embed_manifests(mattes, part.attributes);
        for (size_t c = 0; c < file.parts[p].channels.size(); ++c) {
            const Channel& channel = file.parts[p].channels[c];
            if (!layout_.is_plain() && image::is_bookkeeping(channel.name)) continue;
            const auto known = outcomes_.find(layer_of({p, c}));
            const LayerOutcome fate = known == outcomes_.end() ? LayerOutcome::Same : known->second;
            const bool is_of_other_view = !layout_.view().empty() && !foreign_layers_.count({p, c});
            if (fate == LayerOutcome::NotStored || is_of_other_view) continue;
            const bool is_summed = fate == LayerOutcome::Sum;
            const Place to{out_.parts.size(), part.channels.size()};
            by_place_[{p, c}] = to;
            std::string name = channel.name;
            if (!layout_.view().empty())
                name = views->channel_name(file.parts[p], name).value_or(name);
            part.channels.push_back(Channel::make(std::move(name),
                                                  is_summed ? ChannelType::Float : channel.type(),
                                                  file.data.pixel_count()));
            if (is_summed) continue;
            places_.push_back({p, c});
            to_.push_back(to);
        }
        if (part.channels.empty()) continue;
        if (!layout_.view().empty()) part.attributes["view"] = layout_.view();
        if (file.parts.size() > 1) part.name = names.make(part.name.empty() ? "part" : part.name);
        out_.parts.push_back(std::move(part));
    }
    out_.attributes = carried_with_ids(file.attributes);
    embed_manifests(mattes, out_.attributes);
}

/// Where channels of the beauty are missing, the sum of its layers is one all the same.
void LayeredMix::add_beauty() {
    if (plan_.family == "beauty") return;
    for (size_t c = 0; c < 3; ++c) {
        if (has({"rgba", "", c})) continue;
        const auto any = layout_.place("rgba", c == 0 ? 1 : 0);
        const auto known = any ? by_place_.find({any->part, any->channel}) : by_place_.end();
        const size_t part = known == by_place_.end() ? 0 : known->second.first;
        auto& channels = out_.parts[part].channels;
        added_[std::string("rgba.") + rgb_names[c]] = {part, channels.size()};
        channels.push_back(
            Channel::make(rgb_names[c], ChannelType::Float, out_.data.pixel_count()));
    }
}

/// A layer that was black may have light now: of a shadow that is lifted, or what a clamp took.
void LayeredMix::add_black_layers() {
    const auto& layers = layout_.header().layers;
    const auto rank_of = [&layers](const std::string& layer) {
        return std::find_if(layers.begin(), layers.end(),
                            [&](const LayerEntry& e) { return e.name == layer; });
    };
    for (const MixPlan::Term& shadow : plan_.shadow_terms) {
        const std::string& layer = shadow.direct_layer;
        const bool is_there = std::any_of(terms_.begin(), terms_.end(),
                                          [&](const auto& t) { return t.layer == layer; });
        if (is_there || layer.empty()) continue;
        const auto at = std::find_if(terms_.begin(), terms_.end(), [&](const auto& t) {
            return rank_of(t.layer) > rank_of(layer);
        });
        terms_.insert(at, MixPlan::Term{layer});
    }
    for (const std::string& half : halves_) {
        for (const MixPlan::Term& term : terms_) {
            const bool is_lit =
                (!term.clamp_layer.empty() && has({term.clamp_layer, half, 0})) ||
                std::any_of(plan_.shadow_terms.begin(), plan_.shadow_terms.end(),
                            [&](const auto& s) {
                                return s.direct_layer == term.layer && has({s.layer, half, 0});
                            });
            if (is_lit) add_channels({term.layer, half, 0}, terms_[0].layer);
        }
        for (const LayerEntry& e : layers) {
            const auto fate = outcomes_.find(e.name);
            if (e.family == "halves" || fate->second != LayerOutcome::Sum) continue;
            const auto sources = sources_of(e);
            const bool is_lit = std::any_of(sources.begin(), sources.end(), [&](const auto& s) {
                return has({s, half, 0});
            });
            if (is_lit) add_channels({e.name, half, 0}, e.name);
        }
    }
}

/// In the part of a layer of the same family.
void LayeredMix::add_channels(const Target& target, const std::string& like) {
    if (has(target)) return;
    const LayerEntry* of = layout_.header().find(like);
    size_t part = out_.parts.size();
    for (const LayerEntry& e : layout_.header().layers) {
        const auto place = layout_.place(full_name(e.name, target.half), 0);
        if (!place || !of || e.family != of->family) continue;
        const auto at = by_place_.find({place->part, place->channel});
        if (at != by_place_.end()) part = at->second.first;
    }
    if (part == out_.parts.size()) {
        out_.parts.emplace_back().name = of ? of->family + target.half : target.layer;
    }
    const std::string name = full_name(target.layer, target.half);
    for (const char* c : rgb_names) {
        auto& channels = out_.parts[part].channels;
        added_[name + "." + c] = {part, channels.size()};
        channels.push_back(
            Channel::make(name + "." + c, ChannelType::Float, out_.data.pixel_count()));
    }
}

void LayeredMix::take(const layers::Strip& strip) {
    const size_t first = out_.data.index(out_.data.x0, strip.y0);
    const size_t count = size_t(strip.y1 - strip.y0) * size_t(out_.data.width());
    for (size_t i = 0; i < to_.size(); ++i) {
        Channel& to = out_.parts[to_[i].first].channels[to_[i].second];
        const size_t bytes = to.byte_count() / to.size();
        std::memcpy(static_cast<char*>(to.bytes()) + first * bytes, strip.channels[i].values,
                    count * bytes);
    }
}

/// Of the family, for a bounce or a group.
std::vector<std::string> LayeredMix::sources_of(const LayerEntry& entry) const {
    std::vector<std::string> sources;
    for (const MixPlan::Term& term : terms_) {
        const LayerEntry* e = layout_.header().find(term.layer);
        const bool is_of =
            e && (entry.family == "bounces" ? e->bounce == entry.bounce : e->group == entry.group);
        if (is_of) sources.push_back(term.layer);
    }
    return sources;
}

bool LayeredMix::has(const Target& target) const {
    if (added_.count(full_name(target.layer, target.half) + "." + rgb_names[target.c]) != 0)
        return true;
    const auto place = layout_.place(full_name(target.layer, target.half), target.c);
    return place && by_place_.count({place->part, place->channel}) != 0;
}

Channel* LayeredMix::channel(const Target& target) {
    const std::string name = full_name(target.layer, target.half);
    Place at;
    if (const auto own = added_.find(name + "." + rgb_names[target.c]); own != added_.end()) {
        at = own->second;
    } else {
        const auto place = layout_.place(name, target.c);
        if (!place) return nullptr;
        const auto known = by_place_.find({place->part, place->channel});
        if (known == by_place_.end()) return nullptr;
        at = known->second;
    }
    return &out_.parts[at.first].channels[at.second];
}

/// As floats, whatever the file has.
Values* LayeredMix::values(const Target& target) {
    Channel* const of = channel(target);
    if (!of) return nullptr;
    if (!std::holds_alternative<Values>(of->data)) of->data = floats_of(*of);
    return std::get_if<Values>(&of->data);
}

const MixPlan::Term* LayeredMix::beside(const std::string& layer) const {
    const auto at = std::find_if(plan_.beside.begin(), plan_.beside.end(),
                                 [&](const auto& t) { return t.layer == layer; });
    return at == plan_.beside.end() ? nullptr : &*at;
}

/// The operations of a mix without layers, in its order.
Values LayeredMix::gained(const MixPlan::Term& term, const Values& values, size_t c) const {
    const float gain = term.gain[c] * exposure_;
    const bool is_matted = has_mattes(term);
    Values to(values.size());
    for (size_t i = 0; i < to.size(); ++i)
        to[i] = gain * (is_matted ? values[i] * plan_.matte_factor(term, c, i) : values[i]);
    return to;
}

/// Stored ones, in the order in which they add up.
std::vector<std::string> LayeredMix::casters_of(const LayerEntry& shadow) const {
    std::vector<std::string> casters;
    for (const LayerEntry& e : layout_.header().layers) {
        if (shadow.family == "shadow" && e.family == "caster" && e.group == shadow.group &&
            has({e.name, "", 0}))
            casters.push_back(e.name);
    }
    return casters;
}

/// R, G and B of the layers of some fates and of their half images, in any order.
void LayeredMix::for_each(std::initializer_list<LayerOutcome> outcomes,
                          const std::function<void(const LayerEntry&, const Target&)>& body) {
    std::vector<std::pair<const LayerEntry*, Target>> jobs;
    for (const LayerEntry& e : layout_.header().layers) {
        const auto fate = outcomes_.find(e.name);
        if (e.family == "halves" || fate == outcomes_.end()) continue;
        if (std::find(outcomes.begin(), outcomes.end(), fate->second) == outcomes.end()) continue;
        for (const std::string& half : halves_) {
            for (size_t c = 0; c < 3; ++c)
                if (has({e.name, half, c})) jobs.push_back({&e, {e.name, half, c}});
        }
    }
    parallel_for(jobs.size(), [&](size_t i) { body(*jobs[i].first, jobs[i].second); });
}

void LayeredMix::clear_not_finite() {
    const auto width = size_t(out_.data.width());
    const auto clear = [&](const std::string& layer, Channel& channel) {
        if (channel.type() == ChannelType::Uint) return;
        const layers::StripChannel stored{channel.type(), channel.bytes()};
        Values finite(channel.size());
        const bool has_bad = load_row(stored, 0, finite.size(), finite.data());
        if (has_bad) {
            const NotFinite found = find_not_finite(stored, 0, finite.size());
            const NotFiniteLayer told{layer, found.count, out_.data.x0 + int(found.first % width),
                                      out_.data.y0 + int(found.first / width)};
            const std::scoped_lock lock(mutex_);
            const auto [at, is_new] = not_finite_.try_emplace(layer, told);
            if (!is_new) {
                at->second.values += told.values;
                if (std::pair(told.y, told.x) < std::pair(at->second.y, at->second.x)) {
                    at->second.x = told.x;
                    at->second.y = told.y;
                }
            }
        }
        channel.data = std::move(finite);
    };
    using enum LayerOutcome;
    for_each({Graded, Shadow, Beside, Uniform, Clamp}, [&](const LayerEntry&, const Target& t) {
        clear(full_name(t.layer, t.half), *channel(t));
    });
    const bool is_gained = plan_.family == "beauty" || plan_.family == "plain";
    for (size_t c = is_gained ? 0 : 3; c < 4; ++c) {
        const auto place = layout_.place("rgba", c);
        if (!place) continue;
        const auto known = by_place_.find({place->part, place->channel});
        // Shades of gray have one channel for all three; rows are cleared with the others
        const bool is_row = c == 3 && layout_.is_plain() && !layout_.has_beauty();
        if (known == by_place_.end() || is_row) continue;
        Channel* const split = c < 3 ? channel({"rgba", "", c}) : nullptr;
        Channel& of_beauty =
            split ? *split : out_.parts[known->second.first].channels[known->second.second];
        const ChannelType type = of_beauty.type();
        clear("rgba", of_beauty);
        if (c == 3 && type == ChannelType::Half) make_half(of_beauty);
    }
}

void LayeredMix::gain_family(const MixPlan::Term& term, const Target& target) {
    Values* const own = values(target);
    if (!own) return;
    Values whole = *own;
    if (!term.clamp_layer.empty()) {
        if (const Values* taken = values({term.clamp_layer, target.half, target.c})) {
            for (size_t i = 0; i < whole.size(); ++i)
                whole[i] += plan_.clamp_share(term, i) * (*taken)[i];
        }
    }
    whole = gained(term, whole, target.c);
    for (const MixPlan::Term& shadow : plan_.shadow_terms) {
        if (shadow.direct_layer != term.layer) continue;
        const Values* blocked = values({shadow.layer, target.half, target.c});
        if (!blocked) continue;
        const Values lifted = gained(shadow, *blocked, target.c);
        for (size_t i = 0; i < whole.size(); ++i) whole[i] += lifted[i];
    }
    *own = std::move(whole);
}

void LayeredMix::gain_shadow(const LayerEntry& entry, const Target& target) {
    Values& own = *values(target);
    Values left = gained(*beside(entry.name), own, target.c);
    for (const MixPlan::Term& term : plan_.shadow_terms) {
        const LayerEntry* of = layout_.header().find(term.layer);
        const bool is_of_group =
            entry.family == "caster" && of->family == "shadow" && of->group == entry.group;
        if (term.layer != entry.name && !is_of_group) continue;
        const Values lifted = gained(term, own, target.c);
        for (size_t i = 0; i < left.size(); ++i) left[i] -= lifted[i];
    }
    own = std::move(left);
}

void LayeredMix::gain_clamp(const LayerEntry& entry, const Target& target) {
    Values& own = *values(target);
    for (const MixPlan::Term& term : terms_) {
        if (term.clamp_layer != entry.name) continue;
        for (size_t i = 0; i < own.size(); ++i) own[i] -= plan_.clamp_share(term, i) * own[i];
    }
    own = gained(*beside(entry.name), own, target.c);
}

void LayeredMix::fold(const std::vector<std::string>& layers, const Target& target) {
    Values sum(out_.data.pixel_count(), 0.0f);
    for (const std::string& layer : layers) {
        const Values* part = values({layer, target.half, target.c});
        for (size_t i = 0; part && i < sum.size(); ++i) sum[i] += (*part)[i];
    }
    channel(target)->data = std::move(sum);
}

void LayeredMix::gain_all() {
    using enum LayerOutcome;
    std::vector<std::pair<const MixPlan::Term*, Target>> jobs;
    std::vector<std::string> order;
    for (const MixPlan::Term& term : terms_) {
        order.push_back(term.layer);
        for (const std::string& half : halves_)
            for (size_t c = 0; c < 3; ++c) jobs.push_back({&term, {term.layer, half, c}});
    }
    parallel_for(jobs.size(), [&](size_t i) { gain_family(*jobs[i].first, jobs[i].second); });
    for_each({Shadow}, [&](const LayerEntry& e, const Target& t) {
        if (casters_of(e).empty()) gain_shadow(e, t);
    });
    for_each({Shadow}, [&](const LayerEntry& e, const Target& t) {
        const auto casters = casters_of(e);
        if (!casters.empty()) fold(casters, t);
    });
    for_each({Beside}, [&](const LayerEntry& e, const Target& t) {
        *values(t) = gained(*beside(e.name), *values(t), t.c);
    });
    for_each({Uniform}, [&](const LayerEntry& e, const Target& t) {
        *values(t) = gained({e.name, *plan_.common_gain}, *values(t), t.c);
    });
    for_each({Clamp}, [&](const LayerEntry& e, const Target& t) { gain_clamp(e, t); });
    for_each({Sum}, [&](const LayerEntry& e, const Target& t) { fold(sources_of(e), t); });
    if (plan_.family == "beauty") return;
    for_each({Beauty}, [&](const LayerEntry&, const Target& t) {
        const auto fate = outcomes_.find(full_name(t.layer, t.half));
        if (fate == outcomes_.end() || fate->second != Same) fold(order, t);
    });
    // A header that does not name the beauty
    for (size_t c = 0; c < 3 && !outcomes_.count("rgba"); ++c) fold(order, {"rgba", "", c});
}

/// A row or beauty in shades of gray may have colors now.
void LayeredMix::split_gray() {
    for (const LayerEntry& e : layout_.header().layers) {
        const auto gray = layout_.place(e.name, 0);
        const bool is_gray = gray && gray == layout_.place(e.name, 1);
        if (!is_gray || outcomes_.at(e.name) == LayerOutcome::Same) continue;
        const auto known = by_place_.find({gray->part, gray->channel});
        if (known == by_place_.end()) continue;
        const Place at = known->second;
        auto& channels = out_.parts[at.first].channels;
        added_[e.name + ".R"] = at;
        channels[at.second].name = "R";
        for (size_t c = 1; c < 3; ++c) {
            added_[e.name + "." + rgb_names[c]] = {at.first, channels.size()};
            Channel copy = channels[at.second];
            copy.name = rgb_names[c];
            channels.push_back(std::move(copy));
        }
    }
}

/// What is gray still.
void LayeredMix::join_gray() {
    for (const LayerEntry& e : layout_.header().layers) {
        const auto red = added_.find(e.name + ".R");
        if (red == added_.end()) continue;
        auto& channels = out_.parts[red->second.first].channels;
        const auto& values = channels[red->second.second].data;
        if (channel({e.name, "", 1})->data != values || channel({e.name, "", 2})->data != values)
            continue;
        channels[red->second.second].name = "Y";
        std::erase_if(channels, [](const Channel& c) { return c.name == "G" || c.name == "B"; });
    }
}

/// The sum that was taken for the beauty becomes one.
void LayeredMix::add_beauty_of_rows() {
    image::Part beauty;
    beauty.name = "rgba";
    for (size_t c = 0; c < 3; ++c) {
        Channel& of = beauty.channels.emplace_back();
        of.name = rgb_names[c];
        of.data = std::move(sum_of_rows_[c]);
    }
    const auto place = layout_.place("rgba", 3);
    const auto alpha = place ? by_place_.find({place->part, place->channel}) : by_place_.end();
    if (alpha != by_place_.end()) {
        Channel copy = out_.parts[alpha->second.first].channels[alpha->second.second];
        copy.name = "A";
        beauty.channels.push_back(std::move(copy));
    }
    const auto is_bare = [](const Channel& c) { return c.name.find('.') == std::string::npos; };
    image::Part& first = out_.parts[0];
    if (out_.parts.size() == 1 &&
        std::none_of(first.channels.begin(), first.channels.end(), is_bare)) {
        for (Channel& c : beauty.channels) first.channels.push_back(std::move(c));
        return;
    }
    if (first.name.empty()) first.name = "layers";
    for (image::Part& part : out_.parts)
        if (part.name == beauty.name) part.name += "_rows";
    const size_t like = layout_.beauty_part();
    beauty.attributes = layers::carried_attributes(layout_.image().parts[like].attributes);
    if (!layout_.view().empty()) beauty.attributes["view"] = layout_.view();
    out_.parts.insert(out_.parts.begin(), std::move(beauty));
}

/// Of a file of another renderer: the beauty, and then its rows.
void LayeredMix::mix_foreign() {
    std::array<Values, 3> mixed;
    parallel_for(3, [&](size_t c) {
        mixed[c].assign(out_.data.pixel_count(), 0.0f);
        for (const MixPlan::Term& term : terms_) {
            const Values* of = values({term.layer, "", c});
            if (!of) continue;
            const Values part = gained(term, *of, c);
            for (size_t i = 0; i < part.size(); ++i) mixed[c][i] += part[i];
        }
    });
    for_each({LayerOutcome::Beside}, [&](const LayerEntry& e, const Target& t) {
        *values(t) = gained(*beside(e.name), *values(t), t.c);
    });
    for_each({LayerOutcome::Uniform}, [&](const LayerEntry& e, const Target& t) {
        *values(t) = gained({e.name, *plan_.common_gain}, *values(t), t.c);
    });
    if (!layout_.has_beauty()) sum_of_rows_ = std::move(mixed);
    for (size_t c = 0; c < 3 && layout_.has_beauty(); ++c)
        if (Values* const beauty = values({"rgba", "", c})) *beauty = std::move(mixed[c]);
}

void LayeredMix::set_variance() {
    const auto fate = outcomes_.find("variance");
    Channel* variance = nullptr;
    for (image::Part& part : out_.parts) {
        for (Channel& c : part.channels)
            if (c.name == "variance") variance = &c;
    }
    if (!variance || fate == outcomes_.end() || fate->second != LayerOutcome::Variance) return;
    Values now = floats_of(*variance);
    if (plan_.common_gain) {
        const double gain = double((*plan_.common_gain)[0]) * double(exposure_);
        for (float& v : now)
            v = float(std::min(double(v) * gain * gain, double(std::numeric_limits<float>::max())));
    }
    for (size_t c = 0; c < 3 && !plan_.common_gain; ++c) {
        const Values *a = values({"rgba", "_hA", c}), *b = values({"rgba", "_hB", c});
        for (size_t i = 0; i < now.size(); ++i) {
            const double d = a && b ? double((*a)[i]) - double((*b)[i]) : 0;
            now[i] = (c == 0 ? 0.0f : now[i]) + float(d * d / 12.0);
        }
    }
    variance->data = std::move(now);
}

/// A render var may have the beauty under a name of its own.
void LayeredMix::replace_copies_of_beauty() {
    for (const LayerEntry& e : layout_.header().layers) {
        if (e.family != "data" || layout_.is_plain()) continue;
        bool is_copy = true;
        for (size_t c = 0; c < 3 && is_copy; ++c) {
            const Channel* of = has({e.name, "", c}) ? channel({e.name, "", c}) : nullptr;
            const auto* stored = of ? std::get_if<Values>(&of->data) : nullptr;
            is_copy = stored && *stored == rendered_[c];
        }
        if (!is_copy) continue;
        for (size_t c = 0; c < 3; ++c)
            channel({e.name, "", c})->data = channel({"rgba", "", c})->data;
        outcomes_[e.name] = LayerOutcome::Beauty;
    }
}

/// Halves again where the file has halves and no value changes.
void LayeredMix::restore_types() {
    std::vector<Target> layers;
    for (const LayerEntry& e : layout_.header().layers) {
        const auto fate = outcomes_.find(e.name);
        if (e.family == "halves" || fate == outcomes_.end() || fate->second == LayerOutcome::Same)
            continue;
        for (const std::string& half : halves_) layers.push_back({e.name, half, 0});
    }
    parallel_for(layers.size(), [&](size_t l) {
        Target target = layers[l];
        bool fits = true;
        for (target.c = 0; target.c < 3 && fits; ++target.c) {
            const auto place = layout_.place(full_name(target.layer, target.half), target.c);
            fits = place && has(target) &&
                   layout_.image().parts[place->part].channels[place->channel].type() ==
                       ChannelType::Half &&
                   fits_half(*channel(target));
        }
        for (target.c = 0; target.c < 3 && fits; ++target.c) make_half(*channel(target));
    });
}

/// What gains took beyond floats, in whatever layer.
std::optional<NotFiniteLayer> LayeredMix::overflow() {
    const auto width = size_t(out_.data.width());
    NotFinite all{0, out_.data.pixel_count()};
    using enum LayerOutcome;
    for_each({Beauty, Graded, Sum, Shadow, Beside, Uniform, Clamp},
             [&](const LayerEntry&, const Target& t) {
                 const Channel& of = *channel(t);
                 const NotFinite found = find_not_finite({of.type(), of.bytes()}, 0, of.size());
                 const std::scoped_lock lock(mutex_);
                 all.count += found.count;
                 if (found.count > 0) all.first = std::min(all.first, found.first);
             });
    if (all.count == 0) return std::nullopt;
    return NotFiniteLayer{"", all.count, out_.data.x0 + int(all.first % width),
                          out_.data.y0 + int(all.first / width)};
}

image::Image LayeredMix::image(std::vector<NotFiniteLayer>* not_finite) {
    for (size_t c = 0; c < 3; ++c)
        if (const Channel* beauty = channel({"rgba", "", c})) rendered_[c] = floats_of(*beauty);
    if (layout_.is_plain()) split_gray();
    clear_not_finite();
    if (layout_.is_plain())
        mix_foreign();
    else
        gain_all();
    if (not_finite) {
        if (auto beyond = overflow()) not_finite->push_back(*beyond);
        for (const auto& [layer, found] : not_finite_) not_finite->push_back(found);
    }
    set_variance();
    replace_copies_of_beauty();
    restore_types();
    if (layout_.is_plain()) join_gray();
    if (layout_.is_plain() && !layout_.has_beauty()) add_beauty_of_rows();
    if (!layout_.is_plain()) write_header();
    out_.attributes[mix_attribute] = look_to_json(look_);
    return std::move(out_);
}

}  // namespace velatura::compositor::mix
