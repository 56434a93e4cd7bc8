"""`fracctl completion`: scripts with which shells complete words of the command line."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from types import ModuleType

from fracctl.cli import output
from fracctl.cli.parser import Parser

SUMMARY = "print a script that completes commands, options and keys in bash, zsh or fish"

_DESCRIPTION = """\
Print a script for a shell. With it the tab key completes commands, flags, groups and their options, keys of the run
that the line composes, and studies; --config-dir and installed extensions count."""

_EXAMPLES = """\
  source <(fracctl completion bash)                                       in ~/.bashrc
  source <(fracctl completion zsh)                                        in ~/.zshrc, after compinit
  fracctl completion fish > ~/.config/fish/completions/fracctl.fish       once"""

COMPLETE = "--complete"
"""Followed by the line up to the cursor: how the scripts ask for candidates."""

_BASH = r"""
_fracctl() {
    local line=${COMP_LINE:0:COMP_POINT} word typed cut="" candidate
    word=${line##*[[:space:]]}
    typed=$word
    case $COMP_WORDBREAKS in *=*) cut=${typed%"${typed##*=}"} ;; esac
    case $COMP_WORDBREAKS in *:*) typed=${word#"$cut"}; cut=$cut${typed%"${typed##*:}"} ;; esac
    COMPREPLY=()
    while IFS=$'\t' read -r candidate _; do
        if [ "$candidate" = "<files>" ]; then
            compopt -o filenames
            while IFS= read -r candidate; do COMPREPLY+=("$candidate"); done < <(compgen -f -- "${word#"$cut"}")
        else
            COMPREPLY+=("${candidate#"$cut"}")
        fi
    done < <("${COMP_WORDS[0]}" completion --complete "$line" 2>/dev/null)
    case ${COMPREPLY[0]-} in *[=.]) compopt -o nospace ;; esac
}
complete -F _fracctl fracctl
"""

_ZSH = r"""#compdef fracctl
_fracctl() {
    local line
    local -a joined parted with without
    for line in "${(@f)$(${(Q)words[1]} completion --complete "${(j: :)words[1,CURRENT-1]} $PREFIX" 2>/dev/null)}"; do
        parted=("${(@s:	:)line}")
        case $parted[1] in
            '') ;;
            '<files>') _files ;;
            *[=.]) without+=("$parted[1]") ;;
            *) with+=("$parted[1]"); joined+=("${parted[1]}${parted[2]:+  -- $parted[2]}") ;;
        esac
    done
    (( $#without )) && compadd -S '' -a without
    (( $#with )) && compadd -l -d joined -a with
}
if [ "$funcstack[1]" = "_fracctl" ]; then _fracctl "$@"; else compdef _fracctl fracctl; fi
"""

_FISH = r"""
function __fracctl_complete
    set -l words (commandline -opc)
    set -l candidates ($words[1] completion --complete (commandline -cp | string collect) 2>/dev/null)
    for candidate in $candidates
        if string match -q '<files>*' -- $candidate
            __fish_complete_path (commandline -ct)
        else
            printf '%s\n' $candidate
        end
    end
end
complete -c fracctl -f -a '(__fracctl_complete)'
"""

_SCRIPTS = {"bash": _BASH, "zsh": _ZSH, "fish": _FISH}


def parser() -> Parser:
    """Return the command's parser."""
    parser = Parser("completion", "SHELL", _DESCRIPTION, _EXAMPLES)
    parser.add_argument("shell", choices=tuple(_SCRIPTS), metavar="SHELL", help="bash, zsh or fish")
    return parser


def execute(options: argparse.Namespace) -> int:
    """Do what the command line asks for and return the exit code."""
    output.say(_SCRIPTS[options.shell].strip())
    return 0


def show_candidates(line: str, commands: Mapping[str, ModuleType]) -> None:
    """Print what the last word of a line may become, each with its meaning behind a tab; nothing where all fails."""
    from fracctl.cli.candidates import candidates

    try:
        found = candidates(line, commands)
    except Exception:  # noqa: BLE001 - whoever types sees no errors
        return
    for word, meaning in found:
        output.say(f"{word}\t{' '.join(meaning.split())}")
