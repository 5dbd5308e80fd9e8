"""What the settings of every component have in common."""

from pydantic import BaseModel, ConfigDict


class Settings(BaseModel):
    """Typed fields, each with its unit, meaning and the reason of its value; a misspelt key is an error."""

    model_config = ConfigDict(frozen=True, extra="forbid")
