// SPDX-License-Identifier: Apache-2.0
#include "compositor/exports/export_recipe.h"

#include "base/frames.h"
#include "layers/layer_header.h"
#include "layers/strip_reader.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <string_view>
#include <tuple>

namespace velatura::compositor::exports {

namespace {

using layers::ChannelRef;

/// Empty where the file has one part.
std::string part_of(const image::Image& image, const ChannelRef& place) {
    return image.parts.size() < 2 ? std::string() : image.parts[place.part].name;
}

const std::string& name_of(const image::Image& image, const ChannelRef& place) {
    return image.parts[place.part].channels[place.channel].name;
}

/// Where OpenImageIO lists a suffix among those of its layer.
size_t rank_of(std::string suffix) {
    constexpr std::array<std::array<std::string_view, 2>, 10> order = {{{"r", "red"},
                                                                        {"g", "green"},
                                                                        {"b", "blue"},
                                                                        {"real", "real"},
                                                                        {"imag", "imag"},
                                                                        {"a", "alpha"},
                                                                        {"ar", "ra"},
                                                                        {"ag", "ga"},
                                                                        {"ab", "ba"},
                                                                        {"z", "depth"}}};
    for (char& c : suffix) c = char(std::tolower(static_cast<unsigned char>(c)));
    const auto at = std::find_if(order.begin(), order.end(), [&](const auto& names) {
        return suffix == names[0] || suffix == names[1];
    });
    return size_t(at - order.begin());
}

/// The number of a channel as OpenImageIO counts those of a part: by layer, there R G B A first,
/// then as the file has them, by name. Numbers are what oiiotool takes for any name.
size_t number_of(const image::Part& part, const std::string& channel) {
    struct Key {
        std::string layer;
        size_t rank;
        std::string name;

        bool operator<(const Key& k) const {
            return std::tie(layer, rank, name) < std::tie(k.layer, k.rank, k.name);
        }
    };

    const auto key_of = [](const std::string& name) {
        const size_t dot = name.rfind('.');
        const bool is_bare = dot == std::string::npos;
        return Key{is_bare ? "" : name.substr(0, dot),
                   rank_of(is_bare ? name : name.substr(dot + 1)), name};
    };
    const Key key = key_of(channel);
    return size_t(std::count_if(part.channels.begin(), part.channels.end(),
                                [&](const image::Channel& c) { return key_of(c.name) < key; }));
}

bool is_silent(const std::array<float, 3>& gain) {
    return gain[0] == 0.0f && gain[1] == 0.0f && gain[2] == 0.0f;
}

std::array<float, 3> scaled(std::array<float, 3> gain, float factor) {
    for (float& g : gain) g *= factor;
    return gain;
}

/// Parts and channels.
std::vector<std::string> channels_of(const image::Image& image) {
    std::vector<std::string> names;
    for (const image::Part& part : image.parts)
        for (const image::Channel& c : part.channels) names.push_back(part.name + "/" + c.name);
    return names;
}

/// Names the file, in the one form that the programs share, and the frames that are there.
Result<void> name_file(const std::string& file, const std::string& loaded, MixRecipe& recipe) {
    recipe.file = with_hashes(file);
    recipe.is_sequence = is_sequence(file);
    if (!recipe.is_sequence) return {};
    const size_t end = recipe.file.rfind('#') + 1;
    const size_t begin = recipe.file.find_last_not_of('#', end - 1) + 1;
    std::string number = fmt::format("{:0{}}", 7, end - begin);
    if (recipe.file.substr(0, begin) + number + recipe.file.substr(end) != frame_path(file, 7))
        return Error{"export-sequence",
                     fmt::format("{}: the frame number is in a folder or appears more than once, "
                                 "which other programs do not read; name the files with one ####",
                                 file)};
    const std::vector<int> frames = frames_on_disk(file);
    recipe.first_frame = frames.empty() ? frame_in_name(loaded).value_or(1) : frames.front();
    recipe.last_frame = frames.empty() ? recipe.first_frame : frames.back();
    return {};
}

}  // namespace

std::string plain_name(const std::string& layer) {
    std::string name = layer;
    for (char& c : name) {
        const bool is_plain =
            (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
        if (!is_plain) c = '_';
    }
    return name;
}

std::string python_quoted(const std::string& text) {
    return nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::string comment(const MixRecipe& recipe) {
    // Quoted, so that no name ends the line
    return fmt::format(
        "# The mix of {}, by velatura-comp export. Scene-linear, premultiplied.\n# {}\n",
        python_quoted(recipe.file), recipe.look);
}

bool has_plain_channels(const MixRecipe::Term& term) {
    return std::all_of(term.channels.begin(), term.channels.end(), [](const std::string& name) {
        return !name.empty() && std::isdigit(uint8_t(name[0])) == 0 &&
               std::all_of(name.begin(), name.end(), [](char k) {
                   return k == '.' || plain_name(std::string(1, k))[0] == k;
               });
    });
}

Result<MixRecipe> file_recipe(const LayerStack& stack, const Look& look, const std::string& file) {
    const image::Image& image = stack.image();
    if (!image.text(layers::split_attribute).empty()) {
        return Error{"export-split", file +
                                         " keeps its layers in files beside it; export needs one "
                                         "file (--exr-layout multipart or single)"};
    }
    MixRecipe recipe;
    if (const auto named = name_file(file, stack.path(), recipe); !named) return named.error();
    recipe.width = image.display.width();
    recipe.height = image.display.height();
    recipe.look = nlohmann::json::parse(look_to_json(look)).dump();
    recipe.pixel_aspect = image.pixel_aspect_ratio;
    const image::Window &all = image.display, &stored = image.data;
    recipe.offset = {(double(stored.x0) + stored.x1 - all.x0 - all.x1) / 2,
                     (double(all.y0) + all.y1 - stored.y0 - stored.y1) / 2};
    if (const auto alpha = stack.place("rgba", 3)) {
        recipe.has_alpha = true;
        recipe.alpha_part = part_of(image, *alpha);
        recipe.alpha_channel = name_of(image, *alpha);
        recipe.alpha_place = number_of(image.parts[alpha->part], recipe.alpha_channel);
    }
    return recipe;
}

std::vector<LayerStack> other_frames(const LayerStack& stack, const std::string& file) {
    std::vector<LayerStack> others;
    if (!is_sequence(file)) return others;
    std::set<std::vector<std::string>> known = {channels_of(stack.image())};
    const auto foreign = stack.is_plain() ? ForeignFiles::Plain : ForeignFiles::Reject;
    for (const int frame : frames_on_disk(file)) {
        const std::string path = frame_file(file, frame);
        const auto reader = layers::StripReader::open(path);
        if (!reader || !known.insert(channels_of(reader->description())).second) continue;
        // One that cannot be read is told when it is mixed
        if (auto layout = LayerStack::describe(*reader, path, foreign))
            others.push_back(std::move(*layout));
    }
    return others;
}

void add_missing_terms(const std::vector<mix::MixPlan::Term>& from,
                       const layers::LayerHeader& header,
                       std::vector<mix::MixPlan::Term>& to) {
    const auto rank_of = [&header](const std::string& layer) {
        return std::find_if(header.layers.begin(), header.layers.end(),
                            [&](const accumulate::LayerEntry& e) { return e.name == layer; });
    };
    for (const mix::MixPlan::Term& term : from) {
        const bool is_there =
            std::any_of(to.begin(), to.end(), [&](const auto& t) { return t.layer == term.layer; });
        if (is_there) continue;
        to.insert(
            std::find_if(to.begin(), to.end(),
                         [&](const auto& t) { return rank_of(t.layer) > rank_of(term.layer); }),
            term);
    }
}

std::optional<MixRecipe::Term> stored_term(const LayerStack& stack,
                                           std::span<const LayerStack> others,
                                           const std::string& layer,
                                           const std::array<float, 3>& gain) {
    const auto term_of = [&](const LayerStack& of) -> std::optional<MixRecipe::Term> {
        MixRecipe::Term term{layer, {}, gain};
        for (size_t c = 0; c < 3; ++c) {
            const auto place = of.place(layer, c);
            if (!place) return std::nullopt;
            term.channels[c] = name_of(of.image(), *place);
            term.part = part_of(of.image(), *place);
            term.places[c] = number_of(of.image().parts[place->part], term.channels[c]);
        }
        return term;
    };
    if (auto term = term_of(stack)) return term;
    for (const LayerStack& other : others)
        if (auto term = term_of(other)) return term;
    return std::nullopt;
}

Result<MixRecipe> mix_recipe(const LayerStack& stack,
                             const mix::MixPlan& plan,
                             const Look& look,
                             const std::string& file) {
    auto recipe = file_recipe(stack, look, file);
    if (!recipe) return recipe;
    const std::vector<LayerStack> others = other_frames(stack, file);
    const auto add = [&](const std::string& layer, const std::array<float, 3>& gain) {
        // Unless it would add nothing
        if (is_silent(gain)) return;
        if (auto term = stored_term(stack, others, layer, gain))
            recipe->terms.push_back(std::move(*term));
    };
    std::vector<mix::MixPlan::Term> terms = plan.all_terms();
    for (const LayerStack& other : others) {
        if (const auto of_frame = mix::plan_gains(other, look))
            add_missing_terms(of_frame->all_terms(), stack.header(), terms);
    }
    const float exposure = std::exp2(look.exposure_stops);
    for (const mix::MixPlan::Term& term : terms) {
        if (mix::has_mattes(term)) {
            return Error{"export-matte",
                         fmt::format("{} has a gain within a matte, which this script does not "
                                     "support; remove --matte, export to nuke, or mix to .exr",
                                     term.layer)};
        }
        const std::array<float, 3> gain = scaled(term.gain, exposure);
        add(term.layer, gain);
        // What a clamp took is gained as the rest of its layer
        if (!term.clamp_layer.empty())
            add(term.clamp_layer, scaled(gain, plan.clamp_share(term, 0)));
    }
    // All muted: black, of the right size
    std::vector<std::string> black = {"rgba"};
    for (const mix::MixPlan::Term& term : terms) black.push_back(term.layer);
    for (size_t i = 0; i < black.size() && recipe->terms.empty(); ++i) {
        if (auto term = stored_term(stack, others, black[i], {0, 0, 0}))
            recipe->terms.push_back(std::move(*term));
    }
    for (const MixRecipe::Term& term : recipe->terms) {
        if (others.empty() || has_plain_channels(term)) continue;
        return Error{"export-sequence", fmt::format("the frames of {} have different channels, and "
                                                    "other programs do not read the name {}",
                                                    file, term.layer)};
    }
    return recipe;
}

}  // namespace velatura::compositor::exports
