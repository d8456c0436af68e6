// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "compositor/io/layer_stack.h"
#include "compositor/mix/layer_outcomes.h"
#include "compositor/mix/mix.h"
#include "compositor/mix/mix_plan.h"
#include "image/image.h"
#include "layers/strip_reader.h"

#include <array>
#include <functional>
#include <initializer_list>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace velatura::compositor::mix {

/// A mix with all layers of its file that still hold (layer_outcomes.h): the parts of the file, the
/// light of each layer gained as in the mix, values that are not finite as 0, and the rest bit for
/// bit. A light layer of halves stays one where no value changes by it. The beauty is the fold of
/// the stored layers, so that mixing the result with unit gains gives it bit for bit.
///
/// A file of another renderer keeps its parts and names, with a beauty R G B where it had none;
/// of several views the one that is mixed is kept, and files that were opened together become parts
/// of one.
class LayeredMix {
  public:
    LayeredMix(const LayerStack& layout, const MixPlan& plan, const Look& look);

    /// What strips must hold.
    std::span<const layers::ChannelRef> channels() const { return places_; }

    /// Strips may come in any order and from several threads.
    void take(const layers::Strip& strip);

    /// After all strips, once.
    image::Image image(std::vector<NotFiniteLayer>* not_finite);

  private:
    using Values = std::vector<float>;
    using Place = std::pair<size_t, size_t>;  ///< part and channel of the result

    /// R, G or B of a layer, or of a half image of it.
    struct Target {
        std::string layer, half;  ///< half: "", "_hA" or "_hB"
        size_t c = 0;
    };

    void add_parts();
    void add_black_layers();
    void add_channels(const Target& target, const std::string& beside);
    void add_beauty();
    void find_foreign_layers();
    void name_part(size_t from, image::Part& part) const;
    void split_gray();
    void join_gray();
    void add_beauty_of_rows();
    std::string layer_of(const layers::ChannelRef& place) const;
    std::vector<std::string> sources_of(const accumulate::LayerEntry& entry) const;
    bool has(const Target& target) const;
    image::Channel* channel(const Target& target);
    Values* values(const Target& target);
    const MixPlan::Term* beside(const std::string& layer) const;
    Values gained(const MixPlan::Term& term, const Values& values, size_t c) const;
    std::vector<std::string> casters_of(const accumulate::LayerEntry& shadow) const;
    void for_each(std::initializer_list<LayerOutcome> outcomes,
                  const std::function<void(const accumulate::LayerEntry&, const Target&)>& body);

    void clear_not_finite();
    void gain_family(const MixPlan::Term& term, const Target& target);
    void gain_shadow(const accumulate::LayerEntry& entry, const Target& target);
    void gain_clamp(const accumulate::LayerEntry& entry, const Target& target);
    void fold(const std::vector<std::string>& layers, const Target& target);
    void mix_foreign();
    void gain_all();
    std::optional<NotFiniteLayer> overflow();
    void set_variance();
    void replace_copies_of_beauty();
    void restore_types();
    layers::FamilyClosure measured(layers::FamilyClosure closure);
    void write_header();

    const LayerStack& layout_;
    const MixPlan& plan_;
    const Look& look_;
    const float exposure_;
    std::map<std::string, LayerOutcome> outcomes_;
    std::vector<std::string> halves_ = {""};
    std::vector<MixPlan::Term> terms_;  ///< of the family, with layers that were black
    image::Image out_;
    std::vector<layers::ChannelRef> places_;
    std::vector<Place> to_;                                            ///< per place
    std::map<std::pair<size_t, size_t>, Place> by_place_;              ///< of the file
    std::map<std::pair<size_t, size_t>, std::string> foreign_layers_;  ///< by place in the file
    std::map<std::string, Place> added_;                               ///< by full name
    std::array<Values, 3> sum_of_rows_;  ///< where the file has no beauty
    std::array<Values, 3> rendered_;     ///< the beauty as it was
    std::mutex mutex_;
    std::map<std::string, NotFiniteLayer> not_finite_;
};

}  // namespace velatura::compositor::mix
