// SPDX-License-Identifier: Apache-2.0
#include "compositor/io/join_mattes.h"

#include "base/tasks.h"
#include "compositor/io/layer_stack.h"
#include "compositor/io/row_values.h"
#include "layers/cryptomatte_layers.h"
#include "layers/strip_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>

namespace velatura::compositor {
inline namespace io {

namespace {

constexpr int most_levels = 64;

/// `CryptoObject00.R` belongs to `CryptoObject`.
bool is_rank_of(const image::Channel& channel, const std::vector<layers::Cryptomatte>& mattes) {
    return std::any_of(mattes.begin(), mattes.end(), [&](const layers::Cryptomatte& m) {
        const size_t length = m.layer.size();
        return channel.name.size() > length && channel.name.starts_with(m.layer) &&
               channel.name[length] >= '0' && channel.name[length] <= '9';
    });
}

/// Coverage of a pixel by all ids of a layer.
float covered(const std::vector<layers::MatteRank>& ranks, size_t pixel) {
    float sum = 0.0f;
    for (const layers::MatteRank& rank : ranks) {
        const float v = (*rank.coverage)[pixel];
        if (std::isfinite(v) && (*rank.ids)[pixel] != 0.0f) sum += v;
    }
    return sum;
}

/// What hides the files behind one without an alpha.
std::vector<float> alpha_of_mattes(const MatteInput& input) {
    std::vector<float> alpha(input.image.data.pixel_count(), 0.0f);
    for (const layers::Cryptomatte& matte : input.mattes) {
        const auto ranks = layers::matte_ranks(input.image, matte.layer);
        if (!ranks) continue;
        for (size_t i = 0; i < alpha.size(); ++i) alpha[i] = std::max(alpha[i], covered(*ranks, i));
    }
    return alpha;
}

/// Of the channels that were read, the ranks; `alpha` at its place among them.
Result<void> read_pixels(const layers::StripReader& file,
                         const std::vector<layers::ChannelRef>& ranks,
                         const std::optional<layers::ChannelRef>& alpha,
                         MatteInput& input) {
    const image::Image& all = file.description();
    const size_t pixels = all.data.pixel_count();
    input.image.parts.resize(1);
    std::vector<layers::ChannelRef> places = ranks;
    for (const layers::ChannelRef& place : ranks)
        input.image.parts[0].channels.push_back(image::Channel::make(
            all.parts[place.part].channels[place.channel].name, image::ChannelType::Float, pixels));
    if (alpha) {
        places.push_back(*alpha);
        input.alpha.resize(pixels);
    }
    return file.read(places, [&](const layers::Strip& strip) {
        const size_t begin = all.data.index(all.data.x0, strip.y0);
        const size_t count = size_t(strip.y1 - strip.y0) * size_t(all.data.width());
        for (size_t i = 0; i < ranks.size(); ++i)
            std::memcpy(static_cast<float*>(input.image.parts[0].channels[i].bytes()) + begin,
                        strip.channels[i].values, count * sizeof(float));
        if (alpha) load_row(strip.channels.back(), 0, count, input.alpha.data() + begin);
    });
}

/// A layer of the joined file, and what it is called in each of the others.
struct Group {
    std::string layer;
    std::vector<const layers::Cryptomatte*> of_file;  ///< [file]; null: it has none of this kind
};

std::vector<Group> groups_of(std::span<const MatteInput> files) {
    std::vector<Group> groups;
    for (size_t f = 0; f < files.size(); ++f) {
        for (const bool by_kind : {false, true}) {
            for (const layers::Cryptomatte& matte : files[f].mattes) {
                const auto has = [&](const Group& g) { return g.of_file[f] == &matte; };
                if (std::any_of(groups.begin(), groups.end(), has)) continue;
                const auto fits = [&](const Group& g) {
                    if (g.of_file[f]) return false;
                    return by_kind ? layers::plain_matte_name(g.layer) ==
                                         layers::plain_matte_name(matte.layer)
                                   : g.layer == matte.layer;
                };
                const auto at = std::find_if(groups.begin(), groups.end(), fits);
                if (at != groups.end()) {
                    at->of_file[f] = &matte;
                } else if (by_kind) {
                    groups.push_back({matte.layer, {}});
                    groups.back().of_file.resize(files.size(), nullptr);
                    groups.back().of_file[f] = &matte;
                }
            }
        }
    }
    return groups;
}

/// Names of all files, and ids that stand for another one in a file.
struct JoinedNames {
    std::vector<layers::MatteName> names;
    std::vector<std::map<uint32_t, uint32_t>> changed;  ///< [file]
};

JoinedNames join_names(const Group& group,
                       std::span<const MatteInput> files,
                       std::vector<std::string>& notes) {
    struct Known {
        uint32_t id;
        size_t file;
    };

    JoinedNames joined;
    joined.changed.resize(files.size());
    std::map<std::string, Known> by_name;
    std::map<uint32_t, std::string> by_id;
    for (size_t f = 0; f < files.size(); ++f) {
        if (!group.of_file[f]) continue;
        for (const layers::MatteName& n : group.of_file[f]->names) {
            const auto [name, is_new] = by_name.emplace(n.name, Known{n.id, f});
            if (!is_new) {
                if (name->second.id == n.id || name->second.file == f) continue;
                joined.changed[f][n.id] = name->second.id;
                notes.push_back(fmt::format(
                    "{}: \"{}\" has the ID {:08x} in {} and {:08x} in {}; the joined ID is the "
                    "first",
                    group.layer, n.name, name->second.id, files[name->second.file].path, n.id,
                    files[f].path));
                continue;
            }
            const auto [id, is_free] = by_id.emplace(n.id, n.name);
            if (!is_free)
                notes.push_back(fmt::format(
                    "{}: \"{}\" of {} and \"{}\" of {} have the same ID {:08x}: they are one matte",
                    group.layer, id->second, files[by_name.at(id->second).file].path, n.name,
                    files[f].path, n.id));
            joined.names.push_back(n);
        }
    }
    return joined;
}

/// What a file brings to a layer.
struct Source {
    const MatteInput* file;
    std::vector<layers::MatteRank> ranks;  ///< none: it hides, and has no ids
    const std::map<uint32_t, uint32_t>* changed;
};

void add_share(std::vector<layers::MatteShare>& list, uint32_t id, double coverage) {
    const auto at = std::find_if(list.begin(), list.end(),
                                 [id](const layers::MatteShare& s) { return s.id == id; });
    if (at != list.end())
        at->coverage += coverage;
    else
        list.push_back({id, coverage});
}

/// One pixel of the joined layer, the greatest coverage first.
void join_pixel(const std::vector<Source>& front_to_back,
                int x,
                int y,
                std::vector<layers::MatteShare>& list) {
    list.clear();
    double seen = 1.0;
    for (const Source& source : front_to_back) {
        const image::Window& w = source.file->image.data;
        if (x < w.x0 || x >= w.x1 || y < w.y0 || y >= w.y1) continue;
        const size_t i = w.index(x, y);
        for (const layers::MatteRank& rank : source.ranks) {
            uint32_t id = std::bit_cast<uint32_t>((*rank.ids)[i]);
            const double coverage = double((*rank.coverage)[i]);
            if (id == 0 || coverage == 0.0 || !std::isfinite(coverage)) continue;
            const auto other = source.changed->find(id);
            if (other != source.changed->end()) id = other->second;
            add_share(list, id, seen * coverage);
        }
        seen *= 1.0 - double(source.file->alpha[i]);
        if (!(seen > 0.0)) break;
    }
    std::sort(list.begin(), list.end(),
              [](const layers::MatteShare& a, const layers::MatteShare& b) {
                  const double ca = std::abs(a.coverage), cb = std::abs(b.coverage);
                  return ca != cb ? ca > cb : a.id < b.id;
              });
}

image::Part joined_part(const std::string& layer,
                        const std::vector<Source>& sources,
                        const image::Window& w,
                        int levels) {
    size_t ranks = 0;
    for (const Source& source : sources) ranks += source.ranks.size();
    // The same for all frames of a sequence, whatever they show
    const int stored = levels > 0 ? levels : std::clamp(int(ranks), 1, most_levels);
    image::Part part = layers::make_matte_part(layer, stored, w.pixel_count());
    parallel_for(size_t(w.height()), [&](size_t row) {
        std::vector<layers::MatteShare> list;
        const int y = w.y0 + int(row);
        for (int x = w.x0; x < w.x1; ++x) {
            join_pixel(sources, x, y, list);
            if (!list.empty()) layers::store_mattes(list, stored, w.index(x, y), part);
        }
    });
    return part;
}

}  // namespace

Result<MatteInput> read_mattes(const std::string& path) {
    const auto file = layers::StripReader::open(path);
    if (!file) return file.error();
    const image::Image& all = file->description();
    MatteInput input;
    input.path = path;
    input.image.data = all.data;
    input.image.display = all.display;
    input.image.pixel_aspect_ratio = all.pixel_aspect_ratio;
    input.mattes = layers::cryptomattes_of(all, path);
    std::vector<layers::ChannelRef> ranks;
    bool is_lossy = false;
    for (size_t p = 0; p < all.parts.size(); ++p) {
        for (size_t c = 0; c < all.parts[p].channels.size(); ++c) {
            const image::Channel& channel = all.parts[p].channels[c];
            if (channel.type() != image::ChannelType::Float || !is_rank_of(channel, input.mattes))
                continue;
            ranks.push_back({p, c});
            is_lossy = is_lossy || all.parts[p].is_lossy;
        }
    }
    std::optional<layers::ChannelRef> alpha;
    if (const auto stack = LayerStack::describe(*file, path, ForeignFiles::Plain))
        alpha = stack->place("rgba", 3);
    if (auto done = read_pixels(*file, ranks, alpha, input); !done) return done.error();

    std::vector<layers::Cryptomatte> with_channels;
    std::optional<Error> fault;
    for (const layers::Cryptomatte& matte : input.mattes) {
        const auto found = layers::matte_ranks(input.image, matte.layer);
        if (found) {
            with_channels.push_back(matte);
            if (!matte.fault.empty())
                input.notes.push_back(
                    fmt::format("the manifest of {}: {}", matte.layer, matte.fault));
            continue;
        }
        fault = layers::no_ids(all, matte.layer);
        input.notes.push_back(fmt::format("{} is not joined: {}", matte.layer, fault->message));
    }
    input.mattes = std::move(with_channels);
    if (input.mattes.empty())
        return Error{"matte-layer",
                     path + ": " + (fault ? fault->message : "the file has no Cryptomatte")};
    if (is_lossy)
        input.notes.push_back(
            "Cryptomattes are stored with lossy compression, which changes ids: mattes have holes");
    if (!alpha) {
        input.alpha = alpha_of_mattes(input);
        input.notes.push_back("there is no alpha; what the mattes cover hides what is behind");
    }
    for (float& a : input.alpha) a = std::clamp(a, 0.0f, 1.0f);
    return input;
}

Result<JoinedMattes> join_mattes(std::span<const MatteInput> files, int levels) {
    JoinedMattes joined;
    const MatteInput& front = files.front();
    joined.image.data = front.image.data;
    joined.image.display = front.image.display;
    joined.image.pixel_aspect_ratio = front.image.pixel_aspect_ratio;
    for (const MatteInput& file : files) {
        if (file.image.display != front.image.display) {
            const image::Window &a = front.image.display, &b = file.image.display;
            return Error{
                "files-differ",
                fmt::format("{} has {}×{} pixels, {} has {}×{}: they cannot be one image",
                            front.path, a.width(), a.height(), file.path, b.width(), b.height())};
        }
        image::Window& w = joined.image.data;
        const image::Window& other = file.image.data;
        w = {std::min(w.x0, other.x0), std::min(w.y0, other.y0), std::max(w.x1, other.x1),
             std::max(w.y1, other.y1)};
    }
    for (const Group& group : groups_of(files)) {
        const JoinedNames names = join_names(group, files, joined.notes);
        std::vector<Source> sources;
        for (size_t f = 0; f < files.size(); ++f) {
            sources.push_back({&files[f], {}, &names.changed[f]});
            if (!group.of_file[f]) continue;
            if (auto ranks = layers::matte_ranks(files[f].image, group.of_file[f]->layer))
                sources.back().ranks = std::move(*ranks);
        }
        image::Part part = joined_part(group.layer, sources, joined.image.data, levels);
        const layers::Cryptomatte matte{group.layer, names.names};
        layers::describe_cryptomatte(matte, joined.image.attributes);
        layers::describe_cryptomatte(matte, part.attributes);
        joined.image.parts.push_back(std::move(part));
    }
    return joined;
}

}  // namespace io
}  // namespace velatura::compositor
