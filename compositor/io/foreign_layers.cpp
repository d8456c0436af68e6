// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/foreign_layers.h"

#include "base/unique_names.h"
#include "compositor/io/pass_names.h"
#include "compositor/io/stereo_views.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <set>
#include <tuple>
#include <utility>

namespace velatura::compositor {
inline namespace io {

namespace {

using layers::ChannelRef;

constexpr std::array rgba_suffixes = {"R", "G", "B", "A"};

/// A layer by the name of its channels before the last dot, or by its part.
struct NamedLayer {
    std::string name;
    size_t file = 0;
    bool is_bare = false;  ///< channels without a dot
    bool is_data = false;  ///< by the types of its channels, or as its part says
    std::string of = {};   ///< light that another layer holds already: its name
    std::array<std::optional<ChannelRef>, 4> channels = {};  ///< R G B A
    std::vector<ChannelRef> all = {};                        ///< whatever they are called

    bool has_color() const { return channels[0] && channels[1] && channels[2]; }

    PassKind kind() const { return is_data ? PassKind::Data : pass_kind(name); }

    bool is_beauty() const { return kind() == PassKind::Beauty; }

    bool is_light() const { return has_color() && kind() == PassKind::Light; }
};

std::optional<size_t> component(std::string suffix) {
    constexpr std::array<std::array<const char*, 2>, 4> names = {
        {{"r", "red"}, {"g", "green"}, {"b", "blue"}, {"a", "alpha"}}};
    for (char& c : suffix) c = char(std::tolower(static_cast<unsigned char>(c)));
    for (size_t c = 0; c < names.size(); ++c) {
        if (suffix == names[c][0] || suffix == names[c][1]) return c;
    }
    return std::nullopt;
}

bool says_data(const image::Part& part) {
    const auto at = part.attributes.find("colorInteropID");
    const auto* id = at == part.attributes.end() ? nullptr : std::get_if<std::string>(&at->second);
    return id && *id == "data";
}

/// All layers of the view that is read, in the order of their channels.
std::vector<NamedLayer> named_layers(const image::Image& image,
                                     const StereoViews& views,
                                     const ForeignInputs* files) {
    std::vector<NamedLayer> layers;
    std::map<std::tuple<size_t, std::string, bool>, size_t> places;  // by part, name, is bare
    for (size_t p = 0; p < image.parts.size(); ++p) {
        if (!views.has_part(p)) continue;
        const image::Part& part = image.parts[p];
        const std::string part_name = views.part_name(part);
        for (size_t c = 0; c < part.channels.size(); ++c) {
            const auto full = views.channel_name(part, part.channels[c].name);
            if (!full) continue;
            const size_t dot = full->rfind('.');
            const bool is_bare = dot == std::string::npos;
            const auto index = component(is_bare ? *full : full->substr(dot + 1));
            // A bare channel that is no color is a layer by itself: Z, id, mask
            const bool is_alone = is_bare && !index && (*full != "Y" || part.find("X"));
            const std::string name = is_alone ? *full : is_bare ? part_name : full->substr(0, dot);
            const auto [at, is_new] =
                places.try_emplace({p, name, is_bare && !is_alone}, layers.size());
            if (is_new)
                layers.push_back({.name = name,
                                  .file = files ? files->of_part[p] : 0,
                                  .is_bare = is_bare && !is_alone,
                                  .is_data = says_data(part)});
            NamedLayer& layer = layers[at->second];
            // `key.red` beside `key.R` is no second red
            if (index && layer.channels[*index]) {
                const size_t file = layer.file;
                layers.push_back({.name = *full, .file = file, .is_data = true, .all = {{p, c}}});
                continue;
            }
            layer.all.push_back({p, c});
            if (index) layer.channels[*index] = ChannelRef{p, c};
        }
    }
    return layers;
}

/// An image in shades of gray has the one channel Y, which stands for all three.
void take_gray(const image::Image& image, NamedLayer& layer) {
    if (!layer.is_bare || layer.channels[0] || layer.channels[1] || layer.channels[2]) return;
    for (const ChannelRef& place : layer.all) {
        if (image.parts[place.part].channels[place.channel].name != "Y") continue;
        layer.channels[0] = layer.channels[1] = layer.channels[2] = place;
    }
}

/// Layers whose R, G and B stand in different parts.
void join_parts(std::vector<NamedLayer>& layers) {
    for (size_t i = 0; i < layers.size(); ++i) {
        NamedLayer& layer = layers[i];
        const auto is_broken = [](const NamedLayer& l) {
            return !l.has_color() && (l.channels[0] || l.channels[1] || l.channels[2]);
        };
        if (layer.is_bare || !is_broken(layer)) continue;
        for (size_t j = i + 1; j < layers.size(); ++j) {
            NamedLayer& other = layers[j];
            if (other.is_bare || other.name != layer.name || other.file != layer.file ||
                !is_broken(other))
                continue;
            for (size_t c = 0; c < 4; ++c) {
                if (!layer.channels[c]) layer.channels[c] = std::exchange(other.channels[c], {});
            }
            layer.all.insert(layer.all.end(), other.all.begin(), other.all.end());
            other.all.clear();
        }
    }
    std::erase_if(layers, [](const NamedLayer& l) { return l.all.empty(); });
}

void mark_integers(const image::Image& image, std::vector<NamedLayer>& layers) {
    for (NamedLayer& layer : layers) {
        const bool is_image = layer.is_beauty() || (layer.is_bare && layer.name.empty());
        for (size_t c = 0; c < 3 && !is_image; ++c) {
            if (!layer.channels[c]) continue;
            const image::Channel& channel =
                image.parts[layer.channels[c]->part].channels[layer.channels[c]->channel];
            layer.is_data = layer.is_data || channel.type() == image::ChannelType::Uint;
        }
    }
}

using Found = std::vector<NamedLayer>::iterator;

/// Of layers [begin, end): bare colors without a name, or called as a beauty; then a layer called
/// so; then the only light there is, or the only one with alpha.
Found find_beauty(Found begin, Found end) {
    const auto bare = std::find_if(begin, end, [](const NamedLayer& l) {
        return l.has_color() && l.is_bare && (l.name.empty() || l.is_beauty());
    });
    if (bare != end) return bare;
    Found named = end;
    for (Found at = begin; at != end; ++at) {
        if (!at->has_color() || !at->is_beauty()) continue;
        if (named == end || beauty_rank(at->name) < beauty_rank(named->name)) named = at;
    }
    if (named != end) return named;
    for (const bool needs_alpha : {false, true}) {
        const auto is_one = [&](const NamedLayer& l) {
            return l.is_light() && (!needs_alpha || l.channels[3]);
        };
        const auto at = std::find_if(begin, end, is_one);
        if (at != end && at->is_bare && std::count_if(begin, end, is_one) == 1) return at;
    }
    return end;
}

/// Names that a control can be typed with: the last word where that is enough to tell rows apart.
std::string row_name(const NamedLayer& layer, const std::map<std::string, size_t>& last_words) {
    if (layer.name.empty()) return "unnamed";
    const std::string last = last_word(layer.name);
    return last_words.at(last) == 1 ? last : layer.name;
}

std::string type_of(const image::Image& image, const std::vector<ChannelRef>& places) {
    constexpr std::array names = {"half", "float", "uint"};
    std::optional<image::ChannelType> type;
    for (const ChannelRef& place : places) {
        const image::ChannelType one = image.parts[place.part].channels[place.channel].type();
        if (type && *type != one) return "mixed";
        type = one;
    }
    return type ? names[size_t(*type)] : "mixed";
}

/// Puts the layers together.
class Builder {
  public:
    Builder(const image::Image& image, std::vector<NamedLayer> layers)
        : image_(image), layers_(std::move(layers)) {
        for (const NamedLayer& l : layers_)
            if (l.has_color()) ++last_words_[last_word(l.name)];
    }

    Result<ForeignLayers> run() {
        const auto beauty = find_beauty(layers_.begin(), layers_.end());
        if (beauty == layers_.end()) return run_without_beauty();
        return run_with(*beauty);
    }

  private:
    accumulate::LayerEntry& add_entry(const NamedLayer& layer,
                                      const std::string& name,
                                      const char* family) {
        accumulate::LayerEntry entry;
        entry.name = name;
        entry.family = family;
        entry.type = type_of(image_, layer.all);
        return plain_.header.layers.emplace_back(std::move(entry));
    }

    void add_channels(const NamedLayer& layer, const std::string& name) {
        for (size_t c = 0; c < 4; ++c) {
            if (layer.channels[c])
                plain_.channels.emplace(name + "." + rgba_suffixes[c], *layer.channels[c]);
        }
    }

    void add_row(const NamedLayer& layer) {
        const std::string name = names_.make(row_name(layer, last_words_));
        add_entry(layer, name, "plain").group = name;
        add_channels(layer, name);
        plain_.header.lights.push_back({name, {}, false});
    }

    /// After all rows, which have the better right to their names.
    void add_data(const NamedLayer& layer) {
        const std::string name = names_.make(layer.has_color()    ? row_name(layer, last_words_)
                                             : layer.name.empty() ? std::string("unnamed")
                                                                  : layer.name);
        add_entry(layer, name, "data").of = layer.of;
        if (layer.has_color()) add_channels(layer, name);
        plain_.data.emplace(name, layer.all);
    }

    /// Channels of a row or the beauty that are no colors: `key.Z` beside `key.R`.
    void add_others(const NamedLayer& layer) {
        for (const ChannelRef& place : layer.all) {
            const auto is_here = [&](const auto& c) { return c && *c == place; };
            if (std::any_of(layer.channels.begin(), layer.channels.end(), is_here)) continue;
            const std::string& channel = image_.parts[place.part].channels[place.channel].name;
            add_data({.name = channel, .file = layer.file, .is_data = true, .all = {place}});
        }
    }

    void add_all_data(const std::vector<const NamedLayer*>& used) {
        for (const NamedLayer& layer : layers_) {
            const bool is_used = std::find(used.begin(), used.end(), &layer) != used.end();
            is_used ? add_others(layer) : add_data(layer);
        }
    }

    ForeignLayers run_with(const NamedLayer& beauty) {
        add_entry(beauty, "rgba", "beauty");
        names_.take("rgba");
        for (size_t c = 0; c < 4; ++c) {
            if (beauty.channels[c]) plain_.channels.emplace(rgba_suffixes[c], *beauty.channels[c]);
        }
        std::vector<const NamedLayer*> used = {&beauty};
        for (const NamedLayer& layer : layers_) {
            if (&layer == &beauty || !layer.is_light()) continue;
            add_row(layer);
            used.push_back(&layer);
        }
        plain_.header.lights.push_back({names_.make("rest"), {}, false});
        add_all_data(used);
        return std::move(plain_);
    }

    Result<ForeignLayers> run_without_beauty() {
        std::set<std::string> lights;
        for (const NamedLayer& layer : layers_)
            if (layer.is_light()) lights.insert(layer.name);
        const auto has = [&](const std::string& name) { return lights.count(name) != 0; };
        std::vector<const NamedLayer*> used;
        std::string without;
        names_.take("rgba");
        for (NamedLayer& layer : layers_) {
            if (!layer.is_light()) continue;
            if (is_total(layer.name, has) || is_shadow_pass(layer.name)) {
                if (!is_shadow_pass(layer.name)) layer.of = "rgba";
                without += (without.empty() ? ", without " : ", ") + layer.name;
                continue;
            }
            if (used.empty() && layer.channels[3]) plain_.channels.emplace("A", *layer.channels[3]);
            add_row(layer);
            used.push_back(&layer);
        }
        if (used.empty()) return Error{"not-layers", "the file has no channels R, G and B"};
        add_all_data(used);
        plain_.notes.push_back(
            fmt::format("no beauty; using the sum of its {} light layers{}", used.size(), without));
        return std::move(plain_);
    }

    const image::Image& image_;
    std::vector<NamedLayer> layers_;
    std::map<std::string, size_t> last_words_;
    UniqueNames names_;
    ForeignLayers plain_;
};

/// The beauty of each file becomes a bare layer by the file's name, everything else is data of it.
void name_by_files(std::vector<NamedLayer>& layers, const ForeignInputs& files) {
    std::stable_sort(layers.begin(), layers.end(),
                     [](const NamedLayer& a, const NamedLayer& b) { return a.file < b.file; });
    for (Found begin = layers.begin(); begin != layers.end();) {
        const Found end = std::find_if(begin, layers.end(),
                                       [&](const NamedLayer& l) { return l.file != begin->file; });
        const std::string& file = files.names[begin->file];
        const Found beauty = find_beauty(begin, end);
        for (Found at = begin; at != end; ++at) {
            if (at == beauty) {
                at->name = file;
                at->is_bare = true;
                continue;
            }
            // Without a beauty its light layers are rows; beside one they are parts of it
            if (beauty != end && at->is_light()) at->of = file.empty() ? "rgba" : file;
            at->is_data = at->is_data || beauty != end || at->kind() != PassKind::Light;
            at->name = file.empty() ? at->name : file + "." + at->name;
            at->is_bare = false;
        }
        begin = end;
    }
}

}  // namespace

Result<ForeignLayers> foreign_layers(const image::Image& image,
                                     const std::string& view,
                                     const ForeignInputs* files) {
    const auto views = StereoViews::of(image, view);
    if (!views) return views.error();
    std::vector<NamedLayer> layers = named_layers(image, *views, files);
    for (NamedLayer& layer : layers) take_gray(image, layer);
    mark_integers(image, layers);
    join_parts(layers);
    if (files) name_by_files(layers, *files);
    auto plain = Builder(image, std::move(layers)).run();
    if (!plain) return plain;
    plain->views = views->names();
    plain->view = views->chosen();
    if (!plain->views.empty() && view.empty())
        plain->notes.push_back(fmt::format("views {}: using {}; choose another with --stereo",
                                           fmt::join(plain->views, " "), plain->view));
    return plain;
}

}  // namespace io
}  // namespace velatura::compositor
