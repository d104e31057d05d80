// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/model/make_system.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {

/// Makes a system from values of its parameters, by name. What is not given has its default; an
/// unknown name or a value out of range throws std::invalid_argument.
using ModelFactory = std::function<std::unique_ptr<MechanicalSystem>(const ParameterValues&)>;

/// A model by its name.
struct ModelEntry {
  std::string name;   ///< 1 to 64 letters, digits and underscores, the first one a letter
  ModelFactory make;  ///< from its parameters; called by several threads at once
};

/// The entry of a template model (see model_system.h), whose MakeSystem<Model> is instantiated in
/// one source: by including model_system.h there.
template <class Model>
ModelEntry EntryOf() {
  return {Model::kName, &MakeSystem<Model>};
}

/// Adds models to those that MakeModel and ModelNames know in this process: all of them, or, where
/// one is refused, none. `origin` says in messages where they come from. Throws
/// std::invalid_argument for a name that is taken, that occurs twice or that is no name, and for a
/// factory that is empty. May be called at any time, from any thread. There is no way to take a
/// model away: systems and requests hold on to its code.
void RegisterModels(const std::vector<ModelEntry>& entries, const std::string& origin);

/// Adds one template model, as a program does at the beginning of its `main`.
template <class Model>
void RegisterModel(const std::string& origin = "this program") {
  RegisterModels({EntryOf<Model>()}, origin);
}

}  // namespace contact_flow
