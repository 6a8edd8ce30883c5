# Which precompiled headers each source and each header of ours may be read with: see read_product in
# .ci/lint.
#
#   awk -f families.awk IMPLIED FAMILIES SOURCES
#
# IMPLIED: a header of others and all that it includes, a line each. FAMILIES: paths of files, which include
# what is precompiled, the costliest last. SOURCES: paths, a line each.
# Prints FILE FAMILY SOURCE for all that is to be read and, of the families, all that is needed for it:
# FAMILY is the last one of whose headers FILE includes each, itself or by what it includes, or `none`;
# SOURCE is one that includes FILE, and so is compiled with what FILE needs.

function folder(file) { return substr(file, 1, match(file, /\/[^\/]*$/)) }

function exists(file,    line, found) {
  if (!(file in existing)) {
    found = (getline line <file)
    if (found >= 0) close(file)
    existing[file] = found >= 0
  }
  return existing[file]
}

# Of ours the path; of others what stands between the brackets.
function resolve(file, name, quoted) {
  if (quoted && exists(folder(file) name)) return folder(file) name
  if (exists(name)) return name
  if (exists("client/include/" name)) return "client/include/" name
  return "<" name ">"
}

# counts[FILE], included[FILE, 1…]
function scan(file,    line, name) {
  if (file in counts) return
  counts[file] = 0
  while ((getline line <file) > 0) {
    if (line !~ /^#include [<"]/) continue
    name = substr(line, 11)
    sub(/[>"].*/, "", name)
    included[file, ++counts[file]] = resolve(file, name, line ~ /^#include "/)
  }
  close(file)
}

# Into `reached`: all that FILE includes, itself or by what it includes.
function reach(file,    i, next_file) {
  scan(file)
  for (i = 1; i <= counts[file]; ++i) {
    next_file = included[file, i]
    if (next_file in reached) continue
    reached[next_file] = 1
    if (next_file in implied) add_implied(next_file)
    else if (next_file !~ /^</) reach(next_file)
  }
}

function add_implied(header,    i, all, number) {
  number = split(implied[header], all, " ")
  for (i = 1; i <= number; ++i) reached["<" all[i] ">"] = 1
}

function family_of(file,    best, i, j, fits) {
  if (file in family) return family[file]
  delete reached
  reach(file)
  best = "none"
  for (i = 1; i <= families; ++i) {
    fits = 1
    for (j = 1; j <= counts[names[i]] && fits; ++j) fits = included[names[i], j] in reached
    if (fits) best = names[i]
  }
  return family[file] = best
}

# That FILE is to be read, as `source` is compiled.
function plan(file, source) {
  print file, family_of(file), source
  if (!(family[file] in compiled_as)) compiled_as[family[file]] = source
}

FNR == 1 { ++input }

input == 1 {
  header = $1
  $1 = ""
  implied["<" header ">"] = $0
  next
}

input == 2 {
  names[++families] = $1
  scan($1)
  family[$1] = "none"  # clang 14 does not bear one upon another
  next
}

# What a source includes first is read on its own there, if with the same family.
{
  plan($1, $1)
  delete reached
  reach($1)
  for (file in reached) if (file !~ /^</ && !(file in user)) user[file] = $1
  first = included[$1, 1]
  if (counts[$1] && first !~ /^</ && family_of(first) == family[$1]) on_its_own[first] = 1
}

END {
  for (file in user) if (!(file in on_its_own)) plan(file, user[file])
  for (i = 1; i <= families; ++i) if (names[i] in compiled_as) plan(names[i], compiled_as[names[i]])
}
