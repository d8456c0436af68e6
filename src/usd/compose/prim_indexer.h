// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/compose/prim_index.h"
#include "usd/compose/site.h"

#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace velatura::usd::compose {

class Composer;
class PrimIndexer;

/// The index under construction for whose sake another index is built: an arc from `parent` of that
/// graph leads to `requested`, whose ancestors are being composed first.
struct IndexFrame {
    const PrimIndexer* indexer = nullptr;  ///< of the graph that waits
    int parent = -1;                       ///< node of that graph the arc starts from
    const LayerStack* stack = nullptr;     ///< layer stack the arc leads to
    layer::Path requested;                 ///< site the arc leads to
    MapPtr to_parent;                      ///< requested namespace → parent's namespace
    bool skip_duplicates = false;          ///< leave out sites that the waiting graph has already
};

/// Follows the arcs of one prim: starts from the graph of its parent prim with the child's name
/// appended to all sites, runs tasks in a fixed order of kinds until none is left, and ranks the
/// nodes. Ref: AOUSD Core Specification 1.0.1, §10; the kinds of tasks follow Pixar's Pcp.
class PrimIndexer {
  public:
    PrimIndexer(Composer& composer,
                PrimIndex& index,
                layer::Path stage_path,
                const IndexFrame* frame);

    /// Makes the graph of one site without arcs.
    void start(LayerStack* stack, layer::Path path);
    /// Steps down to a child prim.
    void descend(layer::Token name, bool parent_is_instance);
    /// Follows every arc of the nodes, then ranks.
    void run();

  private:
    enum TaskKind { References, Payloads, Inherits, Specializes, ImpliedClasses, TaskKinds };

    struct VariantTask {
        int node;
        std::string set;
        int number;
    };

    struct ArcRequest {
        ArcType arc;
        int parent;
        int origin;
        LayerStack* stack;
        layer::Path path;
        MapFunction map = {};
        int number = 0;  ///< place in its list
        bool contributes = true;
        bool ancestral = true;  ///< bring the opinions that the site's ancestors imply
        bool skip_duplicates = false;
        SourceLoc loc = {};
    };

    // Growing the graph
    int add_arc(const ArcRequest& request);
    int add_node(Node node);
    int insert_subgraph(const PrimIndex& sub, const Node& top);
    void link_child(int parent, int child);
    void refresh_node(Node& node) const;
    bool is_stronger_sibling(int a, int b) const;
    bool precedes(int a, int b) const;
    bool makes_cycle(const ArcRequest& request) const;
    bool is_duplicate(const ArcRequest& request) const;
    std::string describe_cycle(const ArcRequest& request) const;

    // Tasks
    void add_tasks(int node);
    void eval_references(int node, bool payloads);
    void eval_reference(int node, const SiteReference& reference, int number, bool payload);
    void eval_classes(int node, bool specializes);
    void eval_implied_classes(int node);
    void imply_class_tree(int dest,
                          int source,
                          const MapFunction& transfer,
                          const MapFunction& back);
    int starting_node(int class_node) const;
    bool eval_next_variant();
    bool eval_variant(const VariantTask& task, bool use_fallback);
    std::optional<std::string> variant_selection(int node, const std::string& set) const;
    std::optional<std::string> selection_below(int node,
                                               layer::Path path,
                                               const std::string& set) const;
    void check_unresolved();

    MapFunction arc_map(const Node& parent, layer::Path source, TimeOffset offset) const;
    void mark_inert(int node);
    size_t arc_depth(int node) const;

    // Ranking
    void rank();
    void collect(int node, std::vector<int>& plain, std::vector<int>& deferred) const;
    bool is_stronger_specialize(int a, int b) const;

    void report(const char* code, SourceLoc loc, std::string message) const;

    std::vector<Node>& nodes() { return index_.nodes_; }

    const std::vector<Node>& nodes() const { return index_.nodes_; }

    const Node& node(int i) const { return index_.nodes_[size_t(i)]; }

    struct Unresolved {
        int node;
        std::string target;
        SourceLoc loc;
        bool payload;
    };

    Composer& composer_;
    PrimIndex& index_;
    layer::Path stage_path_;  ///< prim of the stage in whose service this runs
    const IndexFrame* frame_;
    std::deque<int> tasks_[TaskKinds];
    std::vector<VariantTask> variants_;
    std::vector<VariantTask> fallbacks_;
    std::vector<Unresolved> unresolved_;
    int implied_task_ = -1;  ///< class node whose implied classes are under way
    bool overflow_ = false;
};

}  // namespace velatura::usd::compose
