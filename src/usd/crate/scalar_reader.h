// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/value_context.h"
#include "usd/layer/value.h"

namespace velatura::usd::crate {

/// Makes values of ValueReps that hold their value themselves, and of scalars at an offset.
/// Ref: AOUSD Core Specification 1.0.1, 16.3.9 and 16.3.10.
class ScalarReader {
  public:
    explicit ScalarReader(ValueContext& context) : context_(context) {}

    /// False, with a problem in the context, when the value is corrupt. `is_scalar` comes out
    /// false, and nothing is read, when the value is not one of these.
    bool read(ValueRep rep, layer::Value& out, bool& is_scalar);

  private:
    template <class T>
    bool read_scalar(ValueRep rep, layer::Value& out);
    bool read_enumeration(ValueRep rep, layer::Value& out);

    ValueContext& context_;
};

}  // namespace velatura::usd::crate
