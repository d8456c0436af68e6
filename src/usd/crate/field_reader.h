// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/crate/item_reader.h"
#include "usd/crate/value_context.h"
#include "usd/layer/value.h"

#include <vector>

namespace velatura::usd::crate {

class ValueReader;

/// Makes values of fields that lie at an offset: dictionaries, list ops, arcs, time samples,
/// splines. Functions return false, with a problem in the context, when the value is corrupt or of
/// an unknown type. Ref: AOUSD Core Specification 1.0.1, 16.3.10.
class FieldReader {
  public:
    /// `values`: reads values within values.
    FieldReader(ValueContext& context, ValueReader& values)
        : context_(context), values_(values), items_(context, values) {}

    bool read(ValueRep rep, layer::Value& out);

  private:
    template <class T>
    bool read_list_op(Cursor& c, layer::Value& out);
    template <class T>
    bool read_vector(Cursor& c, layer::Value& out);
    bool read_unregistered(Cursor& c, layer::Value& out);
    bool read_times(ValueRep rep, std::vector<double>& out);
    bool read_time_samples(Cursor& c, layer::Value& out);
    bool read_spline(Cursor& c, layer::Value& out);

    ValueContext& context_;
    ValueReader& values_;
    ItemReader items_;
};

}  // namespace velatura::usd::crate
