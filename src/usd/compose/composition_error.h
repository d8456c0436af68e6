// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/source_loc.h"
#include "usd/layer/path.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::usd::compose {

/// What can be wrong with scene description when it is composed.
/// Ref: AOUSD Core Specification 1.0.1, §10; names after Pixar's PcpError.
enum class ErrorKind : uint8_t {
    ArcCycle,                      ///< an arc leads to a site that the prim is composed of already
    ArcToProhibitedChild,          ///< an arc leads to a prim that has been relocated away
    CapacityExceeded,              ///< a limit of ComposeOptions
    InconsistentPropertyType,      ///< attribute in one layer, relationship in another
    InvalidAssetPath,              ///< the file of a reference or payload does not open
    InvalidAuthoredRelocation,     ///< a relocation that can never be
    InvalidConflictingRelocation,  ///< a relocation that contradicts another
    InvalidExternalTargetPath,     ///< a target outside of what its arc brings in
    InvalidInstanceTargetPath,     ///< a class targets an instance of itself
    InvalidPrimPath,               ///< an arc names something that is no prim
    InvalidReferenceOffset,        ///< time offset of a reference or payload
    InvalidSameTargetRelocations,  ///< two relocations to one place
    InvalidSublayerOffset,
    InvalidSublayerOwnership,  ///< two sublayers of the session's owner
    InvalidSublayerPath,       ///< the file of a sublayer does not open
    OpinionAtRelocationSource,
    SublayerCycle,
    UnresolvedPrimPath,  ///< the target prim of a reference or payload does not exist
    VariableExpression,  ///< an expression in an arc, sublayer or variant selection has no value
};

inline constexpr size_t error_kind_count = size_t(ErrorKind::VariableExpression) + 1;

/// "arc-cycle" and so on.
std::string_view error_name(ErrorKind kind);

/// One composition error: data for tests and tools, and the text of a diagnostic.
struct CompositionError {
    ErrorKind kind = ErrorKind::ArcCycle;
    layer::Path prim;         ///< prim (or property) of the stage being composed; "/" for a stack
    std::string layer_stack;  ///< root layer of the stack that holds the site
    layer::Path site;         ///< where the error was met, in that stack's namespace
    std::string message;
    SourceLoc loc;
};

/// Composition errors in the order of arrival; each goes to the Diagnostics too. Thread-safe.
class CompositionErrors {
  public:
    static constexpr size_t stored_limit = 100'000;  ///< beyond that errors are only counted

    explicit CompositionErrors(Diagnostics& diagnostics) : diagnostics_(diagnostics) {}

    /// `code`: of the diagnostic; by the kind when empty.
    void add(CompositionError error, std::string_view code = {});

    std::vector<CompositionError> all() const;
    size_t count() const;
    size_t count(ErrorKind kind) const;

  private:
    Diagnostics& diagnostics_;
    mutable std::mutex mutex_;
    std::vector<CompositionError> errors_;
    std::array<size_t, error_kind_count> counts_ = {};
};

}  // namespace velatura::usd::compose
