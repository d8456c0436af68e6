// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "python/layer_arrays.h"

#include <pybind11/pybind11.h>

#include <memory>

namespace velatura::python {

using LayersClass = pybind11::class_<LayerArrays, std::shared_ptr<LayerArrays>>;

/// Each adds its classes to the module.
void add_stage(pybind11::module_& module);
void add_builder(pybind11::module_& module);
void add_render(pybind11::module_& module);
LayersClass add_layers(pybind11::module_& module);
void add_mix(pybind11::module_& module, LayersClass& layers);

}  // namespace velatura::python
