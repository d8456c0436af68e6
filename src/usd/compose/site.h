// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/source_loc.h"
#include "usd/compose/composition_error.h"
#include "usd/compose/layer_stack.h"
#include "usd/layer/path.h"
#include "usd/layer/token.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace velatura::usd::compose {

// What a layer stack says about one site, list-ops composed over its layers, weakest first.
// Expressions are evaluated; those without a value are added to `errors` where that is given.

/// Kinds of arcs that the specs of a site have.
struct SiteArcs {
    bool has_specs = false;
    bool references = false;
    bool payloads = false;
    bool inherits = false;
    bool specializes = false;
    bool variants = false;
    bool prim_relocates = false;  ///< relocations authored on a prim, which do not count
};

/// Scans the specs of a site once.
SiteArcs site_arcs(const LayerStack& stack, layer::Path site);

/// A reference or payload.
struct SiteReference {
    std::string asset;  ///< as authored, expression evaluated; empty = internal
    std::string file;   ///< asset resolved from the layer that holds the opinion; empty = internal
    layer::Path prim_path;              ///< empty = default prim
    TimeOffset offset;                  ///< as authored
    const StackLayer* layer = nullptr;  ///< holds the opinion
    SourceLoc loc;
};

std::vector<SiteReference> site_references(const LayerStack& stack,
                                           layer::Path site,
                                           bool payloads,
                                           const LayerRegistry& registry,
                                           std::vector<CompositionError>* errors = nullptr);

/// An inherited or specialized class.
struct SiteClass {
    layer::Path path;
    SourceLoc loc;
};

std::vector<SiteClass> site_classes(const LayerStack& stack, layer::Path site, bool specializes);

/// Names of variant sets in composed order.
std::vector<std::string> site_variant_sets(const LayerStack& stack, layer::Path site);

/// Selection that the stack makes for a set at a site; an empty string selects none.
std::optional<std::string> site_variant_selection(const LayerStack& stack,
                                                  layer::Path site,
                                                  const std::string& set,
                                                  std::vector<CompositionError>* errors = nullptr);

/// Adds the selections a stack makes at a site to those that are there, which are stronger.
void site_variant_selections(const LayerStack& stack,
                             layer::Path site,
                             std::map<std::string, std::string>& selections);

/// True when some layer holds this variant.
bool site_has_variant(const LayerStack& stack,
                      layer::Path site,
                      const std::string& set,
                      const std::string& variant);

/// The nearest strength's opinion of a bool field at the site.
std::optional<bool> site_bool(const LayerStack& stack, layer::Path site, layer::Token field);

/// Place of the strongest spec of a site.
SourceLoc site_loc(const LayerStack& stack, layer::Path site);

/// Place of the strongest opinion about a field at a site.
SourceLoc site_field_loc(const LayerStack& stack, layer::Path site, layer::Token field);

}  // namespace velatura::usd::compose
