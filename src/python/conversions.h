// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "python/failure.h"
#include "python/keywords.h"
#include "python/layer_arrays.h"
#include "usd/layer/type_name.h"
#include "usd/layer/value.h"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace velatura::python {

/// Objects of a JSON text.
pybind11::object from_json(const std::string& text);

/// str, or the path of an object of os.PathLike.
std::string path_of(const pybind11::object& path);

/// Keyword arguments as words; None stands for an option that is not given.
std::vector<Keyword> keywords_of(const pybind11::kwargs& kwargs);

/// A USD value: None for no value and for a block, str, bool, int, float, tuples of vectors and
/// quaternions (w, x, y, z), arrays of NumPy that share the value's memory, lists of strings,
/// dicts.
pybind11::object to_python(const usd::layer::Value& value);

/// The same back, of an attribute's type: numbers, tuples, arrays of NumPy, str. Throws: Failure
/// (usage): of another shape or kind, not exact as integers.
usd::layer::Value from_python(const usd::layer::TypeInfo& type, const pybind11::object& value);

/// A read-only array on memory that `owner` keeps.
template <class T>
pybind11::array shared_array(const T* data,
                             std::vector<pybind11::ssize_t> shape,
                             const pybind11::dtype& type,
                             std::shared_ptr<const void> owner) {
    using Owner = std::shared_ptr<const void>;
    const pybind11::capsule base(new Owner(std::move(owner)),
                                 [](void* held) { delete static_cast<Owner*>(held); });
    pybind11::array array(type, std::move(shape), data, base);
    array.attr("setflags")(pybind11::arg("write") = false);
    return array;
}

/// One of the arrays of `layers`, on its memory.
pybind11::array to_python(const std::shared_ptr<const LayerArrays>& layers,
                          const LayerArray& array);

/// Lists of Message as objects of Python.
pybind11::list to_python(const std::vector<Message>& messages);

/// Makes exceptions of the package of each Failure.
void translate_failures();

}  // namespace velatura::python
