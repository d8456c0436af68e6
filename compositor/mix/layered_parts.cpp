// SPDX-License-Identifier: Apache-2.0
#include "compositor/mix/layered_parts.h"

#include "base/result.h"
#include "base/unique_names.h"
#include "compositor/io/file_attributes.h"
#include "compositor/io/stereo_views.h"
#include "image/digest.h"
#include "layers/cryptomatte.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace velatura::compositor::mix {

namespace {

using accumulate::LayerEntry;
using image::Channel;
using image::ChannelType;

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

/// Parts of the file with the channels that the mix stores; what is computed has no values yet.
class StoredParts {
  public:
    explicit StoredParts(LayeredImage& out)
        : out_(out),
          plan_(out.plan()),
          layout_(plan_.layout),
          mattes_(layers::cryptomattes_of(layout_.image(), layout_.path())),
          views_(StereoViews::of(layout_.image(), layout_.view())) {
        if (layout_.is_plain()) find_foreign_layers();
    }

    void add() {
        const image::Image& file = layout_.image();
        UniqueNames names;
        for (size_t p = 0; p < file.parts.size(); ++p) {
            image::Part part;
            part.name = name_of(p);
            part.attributes = carried_with_ids(file.parts[p].attributes);
            embed_manifests(mattes_, part.attributes);
            for (size_t c = 0; c < file.parts[p].channels.size(); ++c) add_channel({p, c}, part);
            if (part.channels.empty()) continue;
            if (has_view()) part.attributes["view"] = layout_.view();
            if (file.parts.size() > 1)
                part.name = names.make(part.name.empty() ? "part" : part.name);
            out_.image().parts.push_back(std::move(part));
        }
        out_.image().attributes = carried_with_ids(file.attributes);
        embed_manifests(mattes_, out_.image().attributes);
    }

  private:
    bool has_view() const { return !layout_.view().empty(); }

    /// Layers of a file of another renderer by their channels: those of the view that is mixed.
    void find_foreign_layers() {
        for (const LayerEntry& e : layout_.header().layers) {
            std::vector<layers::ChannelRef> places;
            if (e.family == "data") places = layout_.data_channels(e.name);
            for (size_t c = 0; c < 4; ++c)
                if (const auto place = layout_.place(e.name, c)) places.push_back(*place);
            for (const layers::ChannelRef& place : places)
                foreign_layers_.try_emplace({place.part, place.channel}, e.name);
        }
    }

    std::string layer_of(const layers::ChannelRef& place) const {
        const std::string& name = layout_.image().parts[place.part].channels[place.channel].name;
        if (!layout_.is_plain()) return name.substr(0, name.find('.'));
        const auto at = foreign_layers_.find({place.part, place.channel});
        return at == foreign_layers_.end() ? std::string() : at->second;
    }

    std::string name_of(size_t p) const {
        const image::Part& part = layout_.image().parts[p];
        if (has_view()) return views_->part_name(part);
        std::string name = part.name;
        const bool is_together =
            layout_.is_plain() && layout_.path().empty() && layout_.image().parts.size() > 1;
        if (!is_together) return name;
        // Of files that were opened together: the name of the file becomes that of its part
        for (const LayerEntry& e : layout_.header().layers) {
            const auto red = layout_.place(e.name, 0);
            if (e.family == "data" || !red || red->part != p) continue;
            const std::string& channel = part.channels[red->channel].name;
            if (channel.find('.') == std::string::npos) name = e.name;
        }
        return name;
    }

    /// To a part that is the next one of the image.
    void add_channel(const layers::ChannelRef& from, image::Part& part) {
        const image::Part& of = layout_.image().parts[from.part];
        const Channel& channel = of.channels[from.channel];
        if (!layout_.is_plain() && image::is_bookkeeping(channel.name)) return;
        const auto known = plan_.outcomes.find(layer_of(from));
        const LayerOutcome outcome =
            known == plan_.outcomes.end() ? LayerOutcome::Same : known->second;
        const bool is_of_other_view =
            has_view() && !foreign_layers_.count({from.part, from.channel});
        if (outcome == LayerOutcome::NotStored || is_of_other_view) return;
        const bool is_summed = outcome == LayerOutcome::Sum;
        out_.keep(from, {out_.image().parts.size(), part.channels.size()}, is_summed);
        std::string name = channel.name;
        if (has_view()) name = views_->channel_name(of, name).value_or(name);
        part.channels.push_back(Channel::make(std::move(name),
                                              is_summed ? ChannelType::Float : channel.type(),
                                              out_.image().data.pixel_count()));
    }

    LayeredImage& out_;
    const LayeredPlan& plan_;
    const LayerStack& layout_;
    std::vector<layers::Cryptomatte> mattes_;
    Result<StereoViews> views_;
    std::map<std::pair<size_t, size_t>, std::string> foreign_layers_;  ///< by place in the file
};

/// A layer that had no light, in the part of a layer of the same family.
void add_layer(const std::string& layer,
               const std::string& half,
               const std::string& like,
               LayeredImage& out) {
    if (out.has({layer, half, 0})) return;
    const LayerStack& layout = out.plan().layout;
    auto& parts = out.image().parts;
    const LayerEntry* of = layout.header().find(like);
    size_t part = parts.size();
    for (const LayerEntry& e : layout.header().layers) {
        const auto place = layout.place(LayerChannel{e.name, half}.full_name(), 0);
        if (!place || !of || e.family != of->family) continue;
        if (const auto at = out.place_of(*place)) part = at->first;
    }
    if (part == parts.size()) parts.emplace_back().name = of ? of->family + half : layer;
    for (size_t c = 0; c < 3; ++c) {
        const LayerChannel as{layer, half, c};
        out.add(as, part,
                Channel::make(as.full_name() + "." + rgb_names[c], ChannelType::Float,
                              out.image().data.pixel_count()));
    }
}

/// A layer that was black may have light now: of a shadow that is lifted, or what a clamp took.
void add_lit_layers(LayeredImage& out) {
    const LayeredPlan& plan = out.plan();
    for (const std::string& half : plan.halves) {
        for (const MixPlan::Term& term : plan.terms) {
            const bool is_lit =
                (!term.clamp_layer.empty() && out.has({term.clamp_layer, half, 0})) ||
                std::any_of(plan.mix.shadow_terms.begin(), plan.mix.shadow_terms.end(),
                            [&](const auto& s) {
                                return s.direct_layer == term.layer && out.has({s.layer, half, 0});
                            });
            if (is_lit) add_layer(term.layer, half, plan.terms[0].layer, out);
        }
        for (const LayerEntry& e : plan.layout.header().layers) {
            if (e.family == "halves" || plan.outcomes.at(e.name) != LayerOutcome::Sum) continue;
            const auto sources = plan.sources_of(e);
            const bool is_lit = std::any_of(sources.begin(), sources.end(), [&](const auto& s) {
                return out.has({s, half, 0});
            });
            if (is_lit) add_layer(e.name, half, e.name, out);
        }
    }
}

/// Where channels of the beauty are missing, the sum of its layers is one all the same.
void add_beauty(LayeredImage& out) {
    if (out.plan().mix.family == "beauty") return;
    for (size_t c = 0; c < 3; ++c) {
        const LayerChannel beauty{"rgba", "", c};
        if (out.has(beauty)) continue;
        const auto any = out.plan().layout.place("rgba", c == 0 ? 1 : 0);
        const auto known = any ? out.place_of(*any) : std::nullopt;
        out.add(beauty, known ? known->first : 0,
                Channel::make(rgb_names[c], ChannelType::Float, out.image().data.pixel_count()));
    }
}

}  // namespace

LayeredImage make_layered_image(const LayeredPlan& plan) {
    LayeredImage out(plan);
    StoredParts(out).add();
    if (plan.layout.is_plain()) return out;
    add_lit_layers(out);
    add_beauty(out);
    return out;
}

}  // namespace velatura::compositor::mix
