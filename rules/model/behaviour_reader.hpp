// Reads behaviours and meta-behaviours (paper, section IV.A) into the model.
#pragma once

#include <optional>
#include <string_view>

#include "rules/model/element_reader.hpp"
#include "rules/model/expression.hpp"
#include "rules/model/model.hpp"
#include "rules/text/diagnostic.hpp"
#include "rules/text/xml.hpp"

namespace arbiter::rules {

bool is_behaviour(std::string_view tag);
bool is_meta_behaviour(std::string_view tag);

// An element that is either of them.
void read_behaviour(const XmlNode& element, ElementReader& reader, Model& model,
                    Diagnostics& diagnostics);

// The condition that is the text of an element: a null pointer where it is blank, nothing where it
// is malformed. The model gets to know the names in it.
std::optional<ExpressionPtr> read_condition(const XmlNode& element, ElementReader& reader,
                                            Model& model, Diagnostics& diagnostics);

// Of an element that is not read: remembers what it would have named, so that its mentions are no
// further mistakes.
void refuse(const XmlNode& element, Model& model);

}  // namespace arbiter::rules
