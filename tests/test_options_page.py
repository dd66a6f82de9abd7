"""docs/agents.md has the table of all options of a run, as `RunConfig` declares them."""

from pathlib import Path

from trainer.config import FLAGS, HYPER, RunConfig

PAGE = Path(__file__).parents[1] / "docs" / "agents.md"
BEGIN, END = "<!-- options: made from trainer/config.py -->\n", "<!-- end of options -->\n"


def table() -> str:
    lines = ["| option | default | meaning |", "|---|---|---|"]
    for name in (*FLAGS, *HYPER):
        field = RunConfig.model_fields[name]
        typed = f"--{name.replace('_', '-')}" if name in FLAGS else f"--hyper {name}=..."
        default = "" if field.default is None else str(field.default).lower()
        lines.append(f"| `{typed}` | {default} | {field.description} |")
    return "\n".join(lines) + "\n"


def test_the_page_has_every_option(update_goldens: bool) -> None:
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    shown, _, after = rest.partition(END)
    if update_goldens:
        PAGE.write_text(before + BEGIN + table() + END + after, encoding="utf-8")
        return
    assert shown == table(), "run `make update-goldens`"
