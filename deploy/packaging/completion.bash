# SPDX-License-Identifier: Apache-2.0
# bash completion for the programs of Tendon. Completes subcommands and options from the output of --help, and file
# names.
_tendon() {
  local program=$1 current=${COMP_WORDS[COMP_CWORD]} help verb=
  # The first word may be a subcommand.
  if ((COMP_CWORD > 1)) && [[ ${COMP_WORDS[1]} != -* ]]; then
    verb=${COMP_WORDS[1]}
  fi
  help=$("$program" ${verb:+"$verb"} --help 2>/dev/null </dev/null) || help=$("$program" --help 2>/dev/null </dev/null)
  if [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$(grep -oE -- '--[a-z][a-z0-9-]*' <<<"$help" | sort -u)" -- "$current")
  elif ((COMP_CWORD == 1)); then
    mapfile -t COMPREPLY < <(compgen -W "$(awk '/^Subcommands:/ { verbs = 1; next } /^[^ ]/ { verbs = 0 } verbs && /^  [a-z]/ { print $1 }' <<<"$help")" -- "$current")
  fi
}
complete -o default -F _tendon \
  tendond tendon-inject tendon-softbody tendon-lab tendon-report tendon-identify tendon-replay tendon-conformance tendon-dash tendon-bridge \
  tendon-sweep tendon-worlds tendon-ship tendon-fem tendon-fem-worker tendon-mesh
