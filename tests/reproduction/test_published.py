"""Reading published.csv: every mistake in it is named with its line."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pytest

from fracctl.errors import ConfigurationError
from fracctl.reproduction.published import read_published

HEADER = "id,place,quantity,unit,published,tolerance,expected,reason"


def written(folder: Path, *lines: str, header: str = HEADER) -> Path:
    path = folder / "published.csv"
    path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    return path


def test_numbers_keep_their_digits(tmp_path: Path) -> None:
    path = written(
        tmp_path, "a,Fig. 2,gain,1,2.0,0.1,reproduced,", 'b,"text, Fig. 4",claim,%,> 0,,reproduced,"so, it is"'
    )
    number, claim = read_published(path)
    assert (number.id, number.place, number.published.text, number.tolerance) == ("a", "Fig. 2", "2.0", Decimal("0.1"))
    assert number.published.last_digit == Decimal("0.1")
    assert (claim.published.relation, claim.published.number, claim.tolerance) == (">", Decimal(0), None)
    assert (claim.place, claim.reason) == ("text, Fig. 4", "so, it is")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("A-1,p,q,1,2.0,0.1,reproduced,", "id 'A-1' must consist of small letters"),
        ("a,p,q,T_orbs,2.0,0.1,reproduced,", "no unit 'T_orbs'; did you mean 'T_orb'?"),
        ("a,p,q,furlong,2.0,0.1,reproduced,", "no unit 'furlong'; one of 1, 1e-3, %, T_orb"),
        ("a,p,q,1,2.0,0.1,reproducd,", "no expected 'reproducd'; did you mean 'reproduced'?"),
        ("a,p,q,1,two,0.1,reproduced,", "published 'two' must be a number"),
        ("a,p,q,1,2.0,,reproduced,", "tolerance '' must be a number"),
        ("a,p,q,1,2.0,-0.1,reproduced,", "tolerance '-0.1' must be a number, at least 0"),
        ("a,p,q,1,> 2,0.1,reproduced,", "a claim has no tolerance"),
        ("a,p,q,1,2.0,0.1,not_reproduced,", "'not_reproduced' needs a reason"),
        ("a,p,q,1,2.0,0.1,not_decidable, ", "'not_decidable' needs a reason"),
        ("a,p,q,1,2.0,0.1", "must have 8 columns"),
        ("a,p,q,1,2.0,0.1,reproduced,so, it is", "must have 8 columns; quote text that holds commas"),
    ],
)
def test_mistakes(tmp_path: Path, line: str, said: str) -> None:
    path = written(tmp_path, line)
    with pytest.raises(ConfigurationError) as caught:
        read_published(path)
    assert str(caught.value).startswith(f"{path}, line 2: ")
    assert said in str(caught.value)


def test_mistakes_of_the_file(tmp_path: Path) -> None:
    line = "a,p,q,1,2.0,0.1,reproduced,"
    with pytest.raises(ConfigurationError, match="line 3: there is a second row 'a'"):
        read_published(written(tmp_path, line, line))
    with pytest.raises(ConfigurationError, match="its first line must be id,place,"):
        read_published(written(tmp_path, line, header="id,quantity"))
    with pytest.raises(ConfigurationError, match=r"cannot read .*: No such file"):
        read_published(tmp_path / "absent.csv")
