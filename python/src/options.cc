// SPDX-License-Identifier: BSD-3-Clause
// Options by keyword: the fields of the plain structs of C++, by their names.
#include <algorithm>
#include <cmath>

#include "contact_flow/io/configuration.h"
#include "contact_flow/nearest_name.h"
#include "convert.h"

namespace contact_flow {
namespace python {
namespace {

using Names = std::vector<std::string>;

/// Calls field(name, reference) for each number of the options that has a name.
template <class Options, class Field>
void Visit(Options* o, Field&& field);

template <class Field>
void Visit(SimulateOptions* o, Field&& field) {
  field("relative_tolerance", &o->relative_tolerance);
  field("absolute_tolerance", &o->absolute_tolerance);
  field("max_step", &o->max_step);
  field("simultaneity_tolerance", &o->simultaneity_tolerance);
  field("gap_tolerance", &o->gap_tolerance);
  field("speed_tolerance", &o->speed_tolerance);
  field("zeno_interval", &o->zeno_interval);
  field("complete_zeno", &o->complete_zeno);
  field("max_steps", &o->max_steps);
  field("max_events", &o->max_events);
  field("max_seconds", &o->max_seconds);
  field("max_megabytes", &o->max_megabytes);
  field("impact_law", &o->impact_law);
  field("method", &o->method);
  field("dense", &o->dense);
}

template <class Field>
void Visit(BDerivativeOptions* o, Field&& field) {
  field("tolerance", &o->tolerance);
  field("kink_tolerance", &o->kink_tolerance);
  field("max_activations_for_pieces", &o->max_activations_for_pieces);
  field("max_pieces", &o->max_pieces);
}

/// True and False, numpy's too.
bool IsBool(const py::handle& value) {
  return py::isinstance<py::bool_>(value) ||
         py::isinstance(value, py::module_::import("numpy").attr("bool_"));
}

template <class T>
void AssignOption(const char* name, const py::handle& value, T* field) {
  if (IsBool(value)) throw py::cast_error(name);  // True is no number here
  *field = value.cast<T>();
}

void AssignOption(const char* name, const py::handle& value, bool* field) {
  if (!IsBool(value)) throw py::cast_error(name);
  *field = value.cast<bool>();
}

void AssignOption(const char*, const py::handle& value, ImpactLaw* field) {
  *field = static_cast<ImpactLaw>(IndexOf("impact_law", py::str(value), ImpactLawNames()));
}

void AssignOption(const char*, const py::handle& value, IntegrationMethod* field) {
  *field =
      static_cast<IntegrationMethod>(IndexOf("method", py::str(value), IntegrationMethodNames()));
}

template <class T>
py::object ToObject(const T& field) {
  return py::cast(field);
}

py::object ToObject(const ImpactLaw& law) {
  return py::cast(ImpactLawNames()[static_cast<std::size_t>(law)]);
}

py::object ToObject(const IntegrationMethod& method) {
  return py::cast(IntegrationMethodNames()[static_cast<std::size_t>(method)]);
}

template <class Options>
Names FieldNames() {
  Options options;
  Names names;
  Visit(&options, [&](const char* name, auto*) { names.push_back(name); });
  return names;
}

template <class Options>
Options Read(const py::kwargs& keywords, Options base, const Names& known) {
  if (keywords.size() == 0) return base;
  for (const auto& entry : keywords) {
    const std::string name = py::str(entry.first);
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      throw py::type_error(UnknownName("option", name, known));
    }
  }
  Visit(&base, [&](const char* name, auto* field) {
    if (!keywords.contains(name)) return;
    const py::object value = keywords[name];
    try {
      AssignOption(name, value, field);
    } catch (const py::cast_error&) {
      throw py::type_error(std::string(name) + " is " + py::repr(value).cast<std::string>() +
                           ", which is not of the kind of its default");
    }
  });
  CheckOptions(base);
  return base;
}

template <class Options>
py::dict Write(Options options) {
  py::dict dict;
  Visit(&options, [&](const char* name, auto* field) { dict[name] = ToObject(*field); });
  return dict;
}

}  // namespace

const Names& SimulateOptionNames() {
  static const Names names = FieldNames<SimulateOptions>();
  return names;
}

const Names& DerivativeOptionNames() {
  static const Names names = FieldNames<BDerivativeOptions>();
  return names;
}

SimulateOptions ToOptions(const py::kwargs& keywords, SimulateOptions base) {
  return Read(keywords, std::move(base), SimulateOptionNames());
}

BDerivativeOptions ToOptions(const py::kwargs& keywords, BDerivativeOptions base) {
  return Read(keywords, std::move(base), DerivativeOptionNames());
}

py::kwargs Take(const Names& names, py::kwargs* keywords) {
  py::kwargs taken;
  for (const std::string& name : names) {
    if (!keywords->contains(name.c_str())) continue;
    taken[name.c_str()] = (*keywords)[name.c_str()];
    keywords->attr("pop")(name);
  }
  return taken;
}

py::dict ToDict(const SimulateOptions& options) { return Write(options); }

py::dict ToDict(const BDerivativeOptions& options) { return Write(options); }

}  // namespace python
}  // namespace contact_flow
